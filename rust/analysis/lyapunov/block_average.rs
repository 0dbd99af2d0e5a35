//! Time averages with honest errors, from the means over blocks of a run.

use crate::scalar::vector;

/// Sums of `N` quantities over consecutive pieces of a run.
#[derive(Clone, Debug)]
pub struct BlockAverages<const N: usize> {
    /// The least time that a block covers.
    pub span: f64,
    /// The sums and the time of each block.
    list: Vec<([f64; N], f64)>,
}

/// Time averages with their uncertainty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Average<const N: usize> {
    pub value: [f64; N],
    /// Standard errors, from the scatter of block means; not a number where there are too few blocks.
    pub standard_error: [f64; N],
    /// The time averaged over.
    pub time: f64,
}

impl<const N: usize> BlockAverages<N> {
    /// With this many blocks neighbours are merged, so that memory stays bounded.
    pub const MOST: usize = 256;
    /// Errors are taken from at least this many blocks. The longer the blocks, the less neighbours are
    /// correlated; the fewer there are, the less certain is their scatter (to 13 % with 32).
    const LEAST: usize = 32;

    /// No blocks yet.
    pub fn new(span: f64) -> Self {
        Self { span, list: Vec::with_capacity(Self::MOST) }
    }

    /// Begins anew.
    pub fn clear(&mut self, span: f64) {
        self.span = span;
        self.list.clear();
    }

    /// Adds a block; true where it is time to look at the [`average`](BlockAverages::average) again.
    pub fn push(&mut self, sums: [f64; N], time: f64) -> bool {
        self.list.push((sums, time));
        if self.list.len() == Self::MOST {
            self.merge();
            self.span *= 2.0;
        }
        self.list.len() >= 2 * Self::LEAST && self.list.len().is_multiple_of(Self::LEAST)
    }

    fn merge(&mut self) {
        let half = self.list.len() / 2;
        for i in 0..half {
            let ((a, s), (b, t)) = (self.list[2 * i], self.list[2 * i + 1]);
            self.list[i] = (vector!(f64, N; n => a[n] + b[n]), s + t);
        }
        self.list.truncate(half);
    }

    /// Drops the first half where it disagrees with the second by more than chance allows: the run was
    /// still on its way to the attractor. Returns whether it did.
    pub fn drop_transient(&mut self) -> bool {
        let half = self.list.len() / 2;
        let (first, second) = (average(&self.list[..half]), average(&self.list[half..]));
        // Four standard errors: chance does that once in ten thousand looks.
        let mut differ = false;
        for n in 0..N {
            let error = first.standard_error[n].hypot(second.standard_error[n]);
            differ |= (first.value[n] - second.value[n]).abs() > 4.0 * error;
        }
        if differ {
            self.list.drain(..half);
        }
        differ
    }

    /// The averages over all blocks.
    pub fn average(&self) -> Average<N> {
        average(&self.list)
    }
}

fn average<const N: usize>(list: &[([f64; N], f64)]) -> Average<N> {
    // As long blocks as can be while enough of them remain.
    let size = (list.len() / BlockAverages::<N>::LEAST).max(1);
    let blocks = list.len() / size;
    let mut time = 0.0;
    let mut total = [0.0; N];
    for block in list {
        time += block.1;
        for n in 0..N {
            total[n] += block.0[n];
        }
    }
    let value = vector!(f64, N; n => total[n] / time);
    // Blocks differ in length by a step or so: each counts by its time.
    let mut scatter = [0.0; N];
    for chunk in list.chunks_exact(size) {
        for n in 0..N {
            let (mut sum, mut time) = (0.0, 0.0);
            for block in chunk {
                sum += block.0[n];
                time += block.1;
            }
            scatter[n] += (sum - value[n] * time).powi(2);
        }
    }
    let count = blocks as f64;
    let error = |n: usize| (scatter[n] * count / (count - 1.0)).sqrt() / time;
    let standard_error = vector!(f64, N; n => if blocks < 2 { f64::NAN } else { error(n) });
    Average { value, standard_error, time }
}

#[cfg(test)]
mod tests {
    use crate::analysis::BlockAverages;

    /// A linear congruential generator's uniform numbers.
    fn noise(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (*seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    }

    /// The mean of correlated noise scatters as its standard error says.
    #[test]
    fn errors_are_honest() {
        let mut seed = 1;
        let (runs, steps) = (400, 4000);
        let mut chi2 = 0.0;
        for _ in 0..runs {
            let mut blocks = BlockAverages::<1>::new(1.0);
            let (mut value, mut sum, mut time) = (0.0, 0.0, 0.0);
            for _ in 0..steps {
                value = 0.9 * value + noise(&mut seed);
                (sum, time) = (sum + value, time + 1.0);
                if time >= blocks.span {
                    blocks.push([sum], time);
                    (sum, time) = (0.0, 0.0);
                }
            }
            let average = blocks.average();
            chi2 += (average.value[0] / average.standard_error[0]).powi(2) / f64::from(runs);
        }
        // Mean square of z over 400 runs: 1 within 4 sqrt(2/400) = 0.28, and a little more for few blocks.
        assert!((0.75..1.4).contains(&chi2), "{chi2}");
    }

    #[test]
    fn a_transient_is_dropped_and_noise_is_not() {
        let mut seed = 2;
        let mut blocks = BlockAverages::<1>::new(1.0);
        for i in 0..200 {
            blocks.push([if i < 60 { 1.0 } else { 0.0 } + noise(&mut seed)], 1.0);
        }
        assert!(blocks.drop_transient());
        assert!(!blocks.drop_transient());
    }
}
