//! Many trajectories: a queue that packets on all cores take from.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use crate::analysis::CancelFlag;
use crate::analysis::batch::parallel::{self, on_threads};
use crate::integrate::cancel;
use crate::scalar::{InstructionSet, Isa, LANES, Packet, Real, Work};

/// Jobs numbered from 0, each taken once, or some of them.
#[derive(Debug)]
pub struct Queue<'a> {
    next: AtomicUsize,
    jobs: usize,
    /// The jobs that each thread may begin with, so that every thread gets some.
    share: usize,
    only: Option<&'a [usize]>,
    stop: &'a CancelFlag,
}

impl Queue<'_> {
    /// The next job; none once all are taken.
    pub fn take(&self) -> Option<usize> {
        let next = self.next.fetch_add(1, Ordering::Relaxed);
        let job = self.only.map_or(Some(next), |only| only.get(next).copied());
        job.filter(|_| next < self.jobs)
    }

    /// How many lanes of a packet are to be filled at the start.
    #[inline(always)]
    pub fn lanes<R: Real>(&self) -> usize {
        self.share.min(R::LANES)
    }

    /// The flag that asks the work to end.
    pub fn stop(&self) -> &CancelFlag {
        self.stop
    }

    /// Whether the work is to end, finished or not.
    pub fn stopped(&self) -> bool {
        self.stop.check().is_err()
    }
}

/// The results of one thread's jobs. They are put in their places in batches: memory is touched once.
#[derive(Debug)]
pub struct ResultSink<'a, Y> {
    batch: Vec<(usize, Y)>,
    all: &'a Mutex<Vec<Option<Y>>>,
    done: &'a AtomicUsize,
}

impl<Y> ResultSink<'_, Y> {
    const BATCH: usize = 256;

    /// A job is done.
    pub fn push(&mut self, job: usize, yielded: Y) {
        self.batch.push((job, yielded));
        self.done.fetch_add(1, Ordering::Relaxed);
        if self.batch.len() == Self::BATCH {
            self.place();
        }
    }

    fn place(&mut self) {
        // Where another thread panicked, so does the whole.
        let Ok(mut all) = self.all.lock() else { return };
        for (job, yielded) in self.batch.drain(..) {
            all[job] = Some(yielded);
        }
    }
}

/// Takes jobs one by one until none is left.
pub type OneByOne<'a, Y> = dyn Fn(&Queue<'_>, &mut ResultSink<'_, Y>) + Sync + 'a;

/// The work of packets on the jobs of a queue.
pub trait BatchJob: Sync {
    /// The result of a job.
    type Yield: Send;

    /// Whether packets are worth it.
    const PACKETS: bool;
    /// How many derivatives its numbers carry.
    const DERIVATIVES: usize = 0;
    /// Whether packets of two registers of AVX-512 are worth their time to compile.
    const DOUBLE: bool = false;

    /// Takes jobs into the lanes of packets until none is left; a lane that finishes one takes the next.
    ///
    /// To be `#[inline(always)]`.
    fn run_batch<R: Real>(&self, queue: &Queue<'_>, results: &mut ResultSink<'_, Self::Yield>);
}

/// How the work is spread; none of it changes a bit of the results.
#[derive(Clone, Copy, Debug)]
pub struct ExecutionContext<'a> {
    /// Threads; 0 for one per core.
    pub threads: usize,
    pub isa: Isa,
    /// Counts the jobs that are done.
    pub done: &'a AtomicUsize,
    pub stop: &'a CancelFlag,
}

/// The results of the jobs, in their order; `None` for those that were not finished when the work was stopped. They
/// go in
/// `packets` where there are some, else one by one.
pub fn run_batch<T: BatchJob>(
    packets: Option<&T>,
    one_by_one: &OneByOne<'_, T::Yield>,
    jobs: usize,
    context: ExecutionContext<'_>,
) -> Vec<Option<T::Yield>> {
    spread(unfinished(jobs), None, context, &|queue, results| match packets {
        Some(work) if T::PACKETS && jobs > 1 && context.isa != Isa::Baseline => {
            context.isa.run(InPackets { work, queue, results });
        }
        _ => one_by_one(queue, results),
    })
}

/// The same where no jobs go in packets.
pub fn run_one_by_one<Y: Send>(
    one_by_one: &OneByOne<'_, Y>,
    jobs: usize,
    context: ExecutionContext<'_>,
) -> Vec<Option<Y>> {
    spread(unfinished(jobs), None, context, one_by_one)
}

fn unfinished<Y>(jobs: usize) -> Vec<Option<Y>> {
    let mut all = Vec::new();
    all.resize_with(jobs, || None);
    all
}

/// The same results, once the jobs whose result `failed` have been done again by other work.
pub fn rerun_failed<Y: Send>(
    one_by_one: &OneByOne<'_, Y>,
    results: Vec<Option<Y>>,
    failed: impl Fn(&Y) -> bool,
    context: ExecutionContext<'_>,
) -> Vec<Option<Y>> {
    let mut again = Vec::new();
    for (job, yielded) in results.iter().enumerate() {
        if yielded.as_ref().is_some_and(&failed) {
            again.push(job);
        }
    }
    if again.is_empty() {
        return results;
    }
    // They were counted as done already.
    let context = ExecutionContext { done: &AtomicUsize::new(0), ..context };
    spread(results, Some(&again), context, one_by_one)
}

/// The whole of the work, compiled for each instruction set.
struct InPackets<'a, 'b, 'c, T: BatchJob> {
    work: &'a T,
    queue: &'a Queue<'b>,
    results: &'a mut ResultSink<'c, T::Yield>,
}

impl<T: BatchJob> Work for InPackets<'_, '_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn run<V: InstructionSet>(self) {
        if const { !T::PACKETS || matches!(V::ISA, Isa::Baseline) } {
            return;
        }
        // With two registers one works while the other waits for a result; numbers with derivatives do so anyway, and
        // two
        // registers for each part leave too few.
        if const { T::DERIVATIVES > 0 && matches!(V::ISA, Isa::Avx2) } {
            self.work.run_batch::<Packet<4, V>>(self.queue, self.results);
        } else if const { T::DOUBLE && matches!(V::ISA, Isa::Avx512) } {
            self.work.run_batch::<Packet<{ 2 * LANES }, V>>(self.queue, self.results);
        } else {
            self.work.run_batch::<Packet<LANES, V>>(self.queue, self.results);
        }
    }
}

fn spread<Y: Send>(
    all: Vec<Option<Y>>,
    only: Option<&[usize]>,
    context: ExecutionContext<'_>,
    work: &OneByOne<'_, Y>,
) -> Vec<Option<Y>> {
    let jobs = only.map_or(all.len(), <[usize]>::len);
    let threads = threads(jobs, context.threads);
    let share = jobs.div_ceil(threads);
    let queue = Queue { next: AtomicUsize::new(0), jobs, share, only, stop: context.stop };
    let all = Mutex::new(all);
    let flag = cancel::current();
    let watch = || {
        let batch = Vec::with_capacity(ResultSink::<Y>::BATCH.min(jobs));
        let mut results = ResultSink { batch, all: &all, done: context.done };
        cancel::under(flag.clone(), || work(&queue, &mut results));
        results.place();
    };
    on_threads(threads, &watch);
    all.into_inner().unwrap_or_else(PoisonError::into_inner)
}

/// More threads than so many for each core only wait for each other.
const MOST_PER_CORE: usize = 4;

/// How many threads so many jobs are worth, where so many are wanted.
fn threads(jobs: usize, wanted: usize) -> usize {
    let threads = if wanted == 0 { parallel::threads() } else { wanted };
    // One packet's worth of jobs is the least that a thread is worth.
    threads.min(jobs.div_ceil(LANES)).clamp(1, MOST_PER_CORE * parallel::threads())
}
