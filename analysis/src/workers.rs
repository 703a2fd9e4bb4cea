//! Parallel execution of runs.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::sync_channel;
use std::thread;

/// Executes runs on `jobs` threads until all are done or `stops` returns true, and passes each result to `take`. A thread ends
/// when `attempt` returns `None`.
pub fn run_parallel<R: Send>(
    runs: &[usize],
    jobs: NonZeroUsize,
    stops: &(dyn Fn() -> bool + Sync),
    attempt: impl Fn(usize, &dyn Fn() -> bool) -> Option<R> + Sync,
    mut take: impl FnMut(R) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let next = AtomicUsize::new(0);
    let broken = AtomicBool::new(false);
    let stops = || broken.load(Ordering::Relaxed) || stops();
    thread::scope(|scope| {
        let (sender, rows) = sync_channel(jobs.get());
        for _ in 0..jobs.get().min(runs.len()) {
            let sender = sender.clone();
            let (next, stops, attempt) = (&next, &stops, &attempt);
            scope.spawn(move || {
                while !stops()
                    && let Some(run) = runs.get(next.fetch_add(1, Ordering::Relaxed))
                    && let Some(row) = attempt(*run, stops)
                    && sender.send(row).is_ok()
                {}
            });
        }
        drop(sender);
        for row in rows {
            if let Err(error) = take(row) {
                broken.store(true, Ordering::Relaxed);
                return Err(error);
            }
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    const JOBS: NonZeroUsize = NonZeroUsize::new(3).unwrap();

    #[test]
    fn each_run_is_executed_once() {
        let runs: Vec<usize> = (2..12).collect();
        let mut done = BTreeSet::new();
        let attempt = |run, _: &dyn Fn() -> bool| Some(run);
        run_parallel(&runs, JOBS, &|| false, attempt, |run| {
            assert!(done.insert(run));
            Ok(())
        })
        .unwrap();
        assert_eq!(done, runs.into_iter().collect());
    }

    #[test]
    fn work_ends_on_request_and_after_an_error_of_take() {
        let runs: Vec<usize> = (0..12).collect();
        let attempt = |run, stops: &dyn Fn() -> bool| (!stops()).then_some(run);
        run_parallel(&runs, JOBS, &|| true, attempt, |_| panic!("a row")).unwrap();
        let mut taken = 0;
        let error = run_parallel(&runs, JOBS, &|| false, attempt, |_| {
            taken += 1;
            anyhow::bail!("the disk is full")
        });
        assert_eq!(error.unwrap_err().to_string(), "the disk is full");
        assert_eq!(taken, 1);
    }
}
