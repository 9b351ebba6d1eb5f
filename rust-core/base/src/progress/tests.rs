//! Calls are watched and cancelled.

use super::*;
use rayon::prelude::*;

#[test]
fn reports_on_the_calling_thread_and_cancels() {
    let pool = crate::threads::pool(2).unwrap();
    let caller = std::thread::current().id();
    let mut ticks = 0;
    let progress = Progress::new(|tick| {
        assert_eq!(std::thread::current().id(), caller);
        assert!((0.0..=1.0).contains(&tick.fraction));
        ticks += 1;
        if ticks == 3 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    let outcome = progress.run(&pool, || -> Result<()> {
        progress.stage(0, 1_000_000);
        loop {
            progress.advance(1)?;
            std::thread::sleep(Duration::from_millis(1));
        }
    });
    assert!(matches!(outcome, Err(Error::Cancelled)));
    assert!(progress.is_stopping());
    drop(progress);
    assert_eq!(ticks, 3);
}

#[test]
fn all_is_done_at_the_end_whatever_is_answered() {
    let mut ticks = Vec::new();
    let progress = Progress::new(|tick| {
        ticks.push(tick);
        if tick.fraction < 1.0 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    });
    stages! { PLAN: FIRST = "first", 0.5; SECOND = "second", 0.5; }
    progress.plan(PLAN);
    progress.stage(SECOND, 2);
    progress.watch(|| progress.advance(1)).unwrap();
    progress.finish();
    assert!(progress.check().is_ok());
    progress.cancel();
    progress.finish();
    drop(progress);
    assert_eq!((FIRST, ticks.len()), (0, 2));
    assert_eq!(ticks[1], Tick { stage: "second", fraction: 1.0 });
}

#[test]
fn plans_of_the_same_stages_have_a_share_of_each() {
    stages! { PLAN, SORTED_PLAN: READING = "reading", 0.25, 0.0; SORTING = "sorting", 0.75, 2.0; }
    assert_eq!((PLAN, READING), (&[("reading", 0.25), ("sorting", 0.75)][..], 0));
    assert_eq!((SORTED_PLAN, SORTING), (&[("reading", 0.0), ("sorting", 2.0)][..], 1));
}

#[test]
fn a_part_counts_in_the_plan_of_the_whole() {
    stages! { PLAN: FIRST = "first", 0.5; SECOND = "second", 0.25; THIRD = "third", 0.25; }
    stages! { PART: ONE = "second", 1.0; TWO = "third", 1.0; }
    let whole = Progress::none();
    whole.plan(PLAN);
    whole.stage(FIRST, 4);
    let part = whole.part(SECOND);
    part.plan(PART);
    assert_eq!(whole.tick(), Tick { stage: "second", fraction: 0.5 });
    part.stage(TWO, 10);
    part.advance(5).unwrap();
    assert_eq!(whole.tick(), Tick { stage: "third", fraction: 0.875 });
    part.reach(8);
    assert_eq!(whole.tick(), Tick { stage: "third", fraction: 0.95 });
    part.lap("a part");
    assert!(whole.seconds().is_empty() && part.seconds().len() == 1);
    assert_eq!((ONE, THIRD), (0, 2));
    whole.cancel();
    assert!(matches!(part.advance(1), Err(Error::Cancelled)));
}

/// As when a scan is made by a function that merges others.
#[test]
fn work_within_work_ends_whatever_the_pools() {
    for (outer, inner) in [(1, 1), (2, 2), (1, 2), (2, 1)] {
        let outer_pool = crate::threads::pool(outer).unwrap();
        let sum: usize = Progress::none().run(&outer_pool, || {
            let nested = |i: usize| {
                let pool = crate::threads::pool(inner).unwrap();
                let mut ticks = 0;
                let progress = Progress::new(|_| {
                    ticks += 1;
                    ControlFlow::Continue(())
                });
                let found = progress.run(&pool, || (0..100).into_par_iter().map(|k| k * i).sum::<usize>());
                drop(progress);
                assert!(ticks > 0);
                found
            };
            (0..8).into_par_iter().map(nested).sum()
        });
        assert_eq!(sum, 28 * 4950, "{outer} and {inner} threads");
    }
}

#[test]
fn watched_work_of_one_thread_reports_and_can_be_cancelled() {
    let mut ticks = 0;
    let progress = Progress::new(|_| {
        ticks += 1;
        ControlFlow::Break(())
    });
    let outcome = progress.watch(|| {
        // The only check: what was answered before the work began must be known to it.
        progress.check()
    });
    assert!(matches!(outcome, Err(Error::Cancelled)));
    drop(progress);
    assert_eq!(ticks, 1);
    let here = std::thread::current().id();
    let nobody = Progress::none();
    assert_eq!(nobody.watch(|| Ok(std::thread::current().id())).unwrap(), here, "a thread for nothing");
}

#[test]
fn laps_of_a_name_add_up_in_the_order_of_the_first_ones() {
    stages! { PLAN: FIRST = "first", 0.25; SECOND = "second", 0.75; }
    let progress = Progress::none();
    progress.plan(PLAN);
    progress.stage(SECOND, 2);
    progress.advance(1).unwrap();
    assert_eq!((FIRST, progress.tick()), (0, Tick { stage: "second", fraction: 0.625 }));
    progress.count_from(vec![("before", 7.0)]);
    for work in ["one", "two", "one"] {
        std::thread::sleep(Duration::from_millis(2));
        progress.lap(work);
    }
    let seconds = progress.seconds();
    assert_eq!(seconds.iter().map(|lap| lap.0).collect::<Vec<_>>(), ["before", "one", "two"]);
    assert!(seconds[0].1 == 7.0 && seconds[1].1 >= 0.004 && seconds[2].1 >= 0.002);
    progress.plan(PLAN);
    assert!(progress.seconds().is_empty(), "of the call before");
}

#[test]
fn cancels_at_the_wanted_check() {
    let progress = Progress::cancel_after(2);
    assert!(progress.check().is_ok());
    assert!(progress.advance(5).is_ok());
    assert!(progress.check().is_err());
    assert!(progress.check().is_err());
}
