//! Loops that are unrolled before the compiler looks at them.

/// Runs the body for `i = from, from + 1, ...` below `count`, a constant, with `i` known when the program
/// is compiled; the count is at most 16. Bodies beyond the count are not compiled.
///
/// Over packets the compiler would otherwise choose between unrolling a loop over components or stages
/// and turning it, instead of the lanes, into vector instructions.
macro_rules! unroll {
    ($i:ident in $from:literal .. $count:tt => $body:block) => {
        $crate::unroll::unroll!(@ $i $from $count, $body, 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15)
    };
    (@ $i:ident $from:literal $count:tt, $body:block, $($k:literal)+) => {
        $(
            #[allow(unconditional_panic, reason = "what lies beyond the count is not compiled")]
            if $crate::unroll::Turn::<$from, $k, $count, 16>::RUNS {
                let $i: usize = $k;
                $body
            }
        )+
    };
}
pub(crate) use unroll;

/// Whether a loop from `FROM` below `COUNT`, at most `MOST`, reaches `K`.
///
/// It does not depend on the types around the loop: a `const` block there would be evaluated, and kept, for each of the
/// functions made of them. That took half of the compiler's memory.
pub(crate) struct Turn<const FROM: usize, const K: usize, const COUNT: usize, const MOST: usize>;

impl<const FROM: usize, const K: usize, const COUNT: usize, const MOST: usize> Turn<FROM, K, COUNT, MOST> {
    pub(crate) const RUNS: bool = {
        assert!(COUNT <= MOST);
        FROM <= K && K < COUNT
    };
}
