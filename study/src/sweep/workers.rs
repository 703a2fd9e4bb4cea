//! Runs side by side.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::sync_channel;
use std::thread;

use super::plan::Plan;
use super::run::{Row, attempt};

/// Does those runs with so many threads, and hands each row over as its run ends, until all are done or it `stops`; runs that
/// are under way then are given up.
///
/// # Errors
/// That of `take`; nothing is begun after it.
pub fn work(
    plan: &Plan,
    runs: &[usize],
    jobs: NonZeroUsize,
    stops: &(dyn Fn() -> bool + Sync),
    mut take: impl FnMut(Row) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let next = AtomicUsize::new(0);
    let broken = AtomicBool::new(false);
    let stops = || broken.load(Ordering::Relaxed) || stops();
    thread::scope(|scope| {
        let (sender, rows) = sync_channel(jobs.get());
        for _ in 0..jobs.get().min(runs.len()) {
            let sender = sender.clone();
            let (next, stops) = (&next, &stops);
            scope.spawn(move || {
                while !stops()
                    && let Some(run) = runs.get(next.fetch_add(1, Ordering::Relaxed))
                    && let Some(row) = attempt(plan, *run, stops)
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
    use missions::waste::data::default_scenario;
    use std::collections::BTreeSet;

    use super::*;

    fn plan() -> Plan {
        let text = "limit_s = 0.5\nseeds = 12";
        Plan::parse("plan.toml", text, |_| Ok(default_scenario())).unwrap()
    }

    const JOBS: NonZeroUsize = NonZeroUsize::new(3).unwrap();

    #[test]
    fn every_run_once() {
        let runs: Vec<usize> = (2..12).collect();
        let mut done = BTreeSet::new();
        work(&plan(), &runs, JOBS, &|| false, |row| {
            assert!(done.insert(row.run));
            Ok(())
        })
        .unwrap();
        assert_eq!(done, runs.into_iter().collect());
    }

    #[test]
    fn it_stops_when_told_and_when_rows_cannot_be_kept() {
        let runs: Vec<usize> = (0..12).collect();
        work(&plan(), &runs, JOBS, &|| true, |_| panic!("a row")).unwrap();
        let mut taken = 0;
        let error = work(&plan(), &runs, JOBS, &|| false, |_| {
            taken += 1;
            anyhow::bail!("the disk is full")
        });
        assert_eq!(error.unwrap_err().to_string(), "the disk is full");
        assert_eq!(taken, 1);
    }
}
