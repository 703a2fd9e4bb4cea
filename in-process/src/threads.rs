//! Threads that share the work of a tick.

use std::hint::spin_loop;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::yield_now;

use crossbeam_utils::CachePadded;
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

/// How often a thread without work looks for more before it sleeps. This takes about 2 ms, longer than the serial part of a
/// tick. To wake a sleeping thread would take much of a tick.
const LOOKS: u32 = 4_000;

/// The pauses between two looks, so that they disturb no other thread.
const PAUSES: u32 = 20;

/// Looks for something at most `looks` times before a thread sleeps. A look takes about half a microsecond, and other threads
/// may use the core between two looks. Returns `None` if there was nothing.
pub fn look_for<T>(looks: u32, look: impl Fn() -> Option<T>) -> Option<T> {
    for _ in 0..looks {
        let found = look();
        if found.is_some() {
            return found;
        }
        for _ in 0..PAUSES {
            spin_loop();
        }
        yield_now();
    }
    None
}

/// The calling thread and a pool of further threads.
pub(super) struct Threads {
    pool: ThreadPool,
    /// The number of calls of [`Threads::share`], in a cache line of its own.
    shared: Arc<CachePadded<AtomicU64>>,
}

impl Threads {
    /// Starts `count - 1` threads, at least one, because the calling thread works, too.
    ///
    /// # Errors
    /// If the system does not start them.
    pub fn new(count: usize) -> Result<Self, ThreadPoolBuildError> {
        let builder = ThreadPoolBuilder::new().num_threads(count.saturating_sub(1).max(1));
        let builder = builder.thread_name(|index| format!("team-{}", index + 1));
        Ok(Self {
            pool: builder.build()?,
            shared: Arc::default(),
        })
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
        self.pool.in_place_scope(|scope| {
            for state in &mut *others {
                scope.spawn(move |_| run(state));
            }
            self.shared.fetch_add(1, Ordering::Release);
            run(own);
        });
        for _ in others {
            self.stay_awake();
        }
    }

    /// Keeps a thread awake until the next call of [`Threads::share`], or for a while.
    fn stay_awake(&self) {
        let shared = Arc::clone(&self.shared);
        let before = shared.load(Ordering::Acquire);
        self.pool.spawn(move || {
            let has_changed = || shared.load(Ordering::Acquire) != before;
            look_for(LOOKS, || has_changed().then_some(()));
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
            // Once while the threads look for work, and once while they sleep.
            for pause_ms in [0, 50] {
                std::thread::sleep(std::time::Duration::from_millis(pause_ms));
                threads.share(&mut states, items.iter_mut(), |_, item| *item += 1);
            }
            assert!(
                items
                    .iter()
                    .copied()
                    .eq((0..1_000).map(|item| 2 * item + 2))
            );
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
