//! Threads that share the work of a tick.

use std::sync::{Mutex, PoisonError};

use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

/// The calling thread and a pool of further threads.
pub(super) struct Threads(ThreadPool);

impl Threads {
    /// Starts `count - 1` threads, at least one, because the calling thread works, too.
    ///
    /// # Errors
    /// If the system does not start them.
    pub fn new(count: usize) -> Result<Self, ThreadPoolBuildError> {
        let builder = ThreadPoolBuilder::new().num_threads(count.saturating_sub(1).max(1));
        let builder = builder.thread_name(|index| format!("team-{}", index + 1));
        builder.build().map(Self)
    }

    /// Passes each item to `work` on some thread, and returns after the last one. A state is used by one thread at a time, so
    /// the number of states limits the number of threads. The order of calls is undefined: `work` must write its results to
    /// the item.
    pub fn share<S: Send, T>(
        &self,
        states: &mut [S],
        items: impl Iterator<Item = T> + Send,
        work: impl Fn(&mut S, T) + Sync,
    ) {
        let items = Mutex::new(items);
        let next = || items.lock().unwrap_or_else(PoisonError::into_inner).next();
        let run = |state: &mut S| {
            while let Some(item) = next() {
                work(state, item);
            }
        };
        let Some((own, others)) = states.split_first_mut() else {
            return;
        };
        let run = &run;
        self.0.in_place_scope(|scope| {
            for state in others {
                scope.spawn(move |_| run(state));
            }
            run(own);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_item_is_passed_once_and_each_state_to_one_thread() {
        for count in [1, 2, 5] {
            let threads = Threads::new(count).unwrap();
            let mut states = vec![0_u64; count];
            let mut items: Vec<u64> = (0..1_000).collect();
            threads.share(&mut states, items.iter_mut(), |state, item| {
                *state += 1;
                *item *= 2;
            });
            assert_eq!(states.iter().sum::<u64>(), 1_000);
            assert!(items.iter().copied().eq((0..1_000).map(|item| 2 * item)));
        }
    }

    #[test]
    #[should_panic(expected = "item 7")]
    fn a_panic_reaches_the_caller() {
        let threads = Threads::new(2).unwrap();
        threads.share(&mut [(), ()], 0..10, |(), item| {
            assert!(item != 7, "item 7")
        });
    }
}
