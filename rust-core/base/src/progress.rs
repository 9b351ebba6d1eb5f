//! Progress of a long call, as one value: its stages with their shares of the time, how far it is, what each stage took, and whether it is
//! to stop.
//!
//! A long call gets a [`Progress`]. Its driver names the stages ([`crate::stages`]). Its workers count what they have done
//! ([`Progress::advance`], an atomic add). The **calling** thread looks at the counts before the work begins and every 30 ms from then on.
//! It hands them to the caller's function, which answers whether to go on. So a host's callback never runs on a foreign thread, and
//! counting costs next to nothing.

use std::ops::{ControlFlow, Range};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

use rayon::slice::ParallelSliceMut;

use crate::error::{Error, Result};

/// The clock of a call.
struct Clock {
    last: Instant,
    seconds: Seconds,
}

/// Time between two questions to the caller's function.
const POLL: Duration = Duration::from_millis(30);

/// State of a long call.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tick {
    /// Name of the running stage, for people.
    pub stage: &'static str,
    /// Share of the whole call that is done, 0 to 1, never falling.
    pub fraction: f64,
}

/// The stages of a call with their shares of its time. Shares are relative to each other.
pub type Plan = &'static [(&'static str, f64)];

/// Wall-clock seconds by what they were spent on, in the order in which that was first done.
pub type Seconds = Vec<(&'static str, f64)>;

/// The stages of a call: a [`Plan`], and the place of each stage in it under a name.
///
/// ```
/// surfrecon_base::stages! {
///     /// Stages with their shares of the time.
///     PLAN:
///     READING = "reading", 0.2;
///     SORTING = "sorting", 0.8;
/// }
/// let progress = surfrecon_base::progress::Progress::none();
/// progress.plan(PLAN);
/// progress.stage(SORTING, 10);
/// assert_eq!(progress.tick().stage, "sorting");
/// ```
///
/// Calls that have the same stages in other shares have a plan each, and each stage a share for each of them:
/// `PLAN, SORTED_PLAN: READING = "reading", 0.2, 0.0; SORTING = "sorting", 0.8, 1.0;`.
#[macro_export]
macro_rules! stages {
    ($(#[$doc:meta])* $visible:vis $($plan:ident),+: $($stage:ident = $words:literal, $($share:literal),+;)+) => {
        $crate::stages!(@plans [$(#[$doc])*] $($words [$($share)+])+; $visible $($plan)+);
        $crate::stages!(@place 0; $visible $($stage)+);
    };
    (@plans [$($doc:tt)*] $($words:literal [$share:literal $($rest:literal)*])+; $visible:vis $plan:ident $($others:ident)*) => {
        $($doc)*
        $visible const $plan: $crate::progress::Plan = &[$(($words, $share)),+];
        $crate::stages!(@plans [$($doc)*] $($words [$($rest)*])+; $visible $($others)*);
    };
    (@plans [$($doc:tt)*] $($words:literal [])+; $visible:vis) => {};
    (@place $place:expr; $visible:vis $stage:ident $($rest:ident)*) => {
        #[doc = "Its place in the plan."]
        $visible const $stage: usize = $place;
        $crate::stages!(@place $place + 1; $visible $($rest)*);
    };
    (@place $place:expr; $visible:vis) => {};
}

type Sink<'a> = Box<dyn FnMut(Tick) -> ControlFlow<()> + Send + 'a>;

/// Stages, progress, seconds and cancelling of one long call.
pub struct Progress<'a> {
    sink: Mutex<Option<Sink<'a>>>,
    plan: Mutex<Plan>,
    stage: AtomicUsize,
    done: AtomicU64,
    total: AtomicU64,
    cancelled: AtomicBool,
    /// Whether a check has answered that.
    heard: AtomicBool,
    /// Checks left before the call is cancelled. `u64::MAX` for no limit.
    checks_left: AtomicU64,
    clock: Mutex<Clock>,
    /// The largest share that the caller's function was told: a call may begin its work anew.
    highest: Mutex<f64>,
    /// The call that this one is a part of, and is cancelled with.
    whole: Option<&'a dyn Whole>,
    /// Place in the plan of that call of this one's first stage. Without one nobody sees what this one counts.
    first: Option<usize>,
}

impl Progress<'static> {
    /// Nobody watches and nobody cancels.
    pub fn none() -> Self {
        Self::with_sink(None)
    }

    /// Cancels at the `checks`-th check (counted from 0): for testing that every way out is clean.
    pub fn cancel_after(checks: u64) -> Self {
        let progress = Self::none();
        progress.checks_left.store(checks, Ordering::Relaxed);
        progress
    }
}

impl<'a> Progress<'a> {
    /// `report` is called on the calling thread before the work begins and about every 30 ms. `ControlFlow::Break` cancels.
    pub fn new(report: impl FnMut(Tick) -> ControlFlow<()> + Send + 'a) -> Self {
        Self::with_sink(Some(Box::new(report)))
    }

    fn with_sink(sink: Option<Sink<'a>>) -> Self {
        Progress {
            sink: Mutex::new(sink),
            plan: Mutex::new(&[("starting", 1.0)]),
            stage: AtomicUsize::new(0),
            done: AtomicU64::new(0),
            total: AtomicU64::new(1),
            cancelled: AtomicBool::new(false),
            heard: AtomicBool::new(false),
            checks_left: AtomicU64::new(u64::MAX),
            highest: Mutex::new(0.0),
            clock: Mutex::new(Clock { last: Instant::now(), seconds: Vec::new() }),
            whole: None,
            first: None,
        }
    }

    /// For a part of this call that plans and counts for itself: it stops with this one, and nobody sees what it counts.
    pub fn unseen(&self) -> Progress<'_> {
        Progress { whole: Some(self), ..Progress::with_sink(None) }
    }

    /// For a part of this call whose stages stand in this one's plan from place `first` on: they are counted here, with the shares that
    /// this plan gives them. The part stops with this call, and times itself.
    pub fn part(&self, first: usize) -> Progress<'_> {
        Progress { whole: Some(self), first: Some(first), ..Progress::with_sink(None) }
    }

    /// The call that counts for this one, and the place of this one's first stage there.
    fn counted_by(&self) -> Option<(&dyn Whole, usize)> {
        self.whole.zip(self.first)
    }

    /// Sets the stages of the call, and starts its clock. The driver calls it before the first stage, and again if the work begins anew.
    pub fn plan(&self, plan: Plan) {
        *lock(&self.plan) = plan;
        self.stage(0, 1);
        self.count_from(Vec::new());
    }

    /// Starts the clock anew: what was done before, once for several calls, took so long.
    pub fn count_from(&self, before: Seconds) {
        *lock(&self.clock) = Clock { last: Instant::now(), seconds: before };
    }

    /// The time since the last lap was spent on `work`, which may come again.
    pub fn lap(&self, work: &'static str) {
        let mut clock = lock(&self.clock);
        let now = Instant::now();
        let seconds = (now - std::mem::replace(&mut clock.last, now)).as_secs_f64();
        match clock.seconds.iter_mut().find(|lap| lap.0 == work) {
            Some(lap) => lap.1 += seconds,
            None => clock.seconds.push((work, seconds)),
        }
    }

    /// Times of the laps so far.
    pub fn seconds(&self) -> Seconds {
        lock(&self.clock).seconds.clone()
    }

    /// Starts stage `index` of the plan, which will count up to `total`.
    pub fn stage(&self, index: usize, total: u64) {
        if let Some((whole, first)) = self.counted_by() {
            return whole.stage(first + index, total);
        }
        self.done.store(0, Ordering::Relaxed);
        self.total.store(total.max(1), Ordering::Relaxed);
        self.stage.store(index, Ordering::Relaxed);
    }

    /// Counts `n` more units of the running stage as done. Cheap. Call it at least every few milliseconds.
    ///
    /// # Errors
    /// [`Error::Cancelled`] once the caller has cancelled: return it at once.
    pub fn advance(&self, n: u64) -> Result<()> {
        self.count(n);
        self.check()
    }

    fn count(&self, n: u64) {
        match self.counted_by() {
            Some((whole, _)) => whole.count(n),
            None => _ = self.done.fetch_add(n, Ordering::Relaxed),
        }
    }

    /// Counts the running stage up to `done`, if it is not there yet: for work whose length is only guessed beforehand.
    pub fn reach(&self, done: u64) {
        match self.counted_by() {
            Some((whole, _)) => whole.reach(done),
            None => _ = self.done.fetch_max(done, Ordering::Relaxed),
        }
    }

    /// Like [`Progress::advance`] with nothing to count.
    ///
    /// # Errors
    /// [`Error::Cancelled`] once the caller has cancelled.
    pub fn check(&self) -> Result<()> {
        if self.checks_left.load(Ordering::Relaxed) != u64::MAX {
            let left =
                self.checks_left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |n| Some(n.saturating_sub(1)));
            if left == Ok(0) {
                self.cancel();
            }
        }
        if !self.cancelled.load(Ordering::Relaxed) {
            return self.whole.map_or(Ok(()), |whole| whole.check());
        }
        self.heard.store(true, Ordering::Relaxed);
        Err(Error::Cancelled)
    }

    /// Whether the work has heard that it is cancelled: what remains is to give its memory back, which takes long for
    /// gigabytes, and nobody need wait for it.
    pub fn is_stopping(&self) -> bool {
        self.heard.load(Ordering::Relaxed)
    }

    /// Asks the call to stop. It answers with [`Error::Cancelled`] within a tenth of a second.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// State of the call now.
    pub fn tick(&self) -> Tick {
        let plan = *lock(&self.plan);
        let index = self.stage.load(Ordering::Relaxed).min(plan.len() - 1);
        let whole: f64 = plan.iter().map(|s| s.1).sum();
        let before: f64 = plan[..index].iter().map(|s| s.1).sum();
        let within = self.done.load(Ordering::Relaxed) as f64 / self.total.load(Ordering::Relaxed) as f64;
        Tick { stage: plan[index].0, fraction: ((before + plan[index].1 * within.min(1.0)) / whole).clamp(0.0, 1.0) }
    }

    /// Runs `work` while this thread reports to the caller's function, if there is one: for work of a single thread.
    ///
    /// # Errors
    /// The result of `work`, or [`Error::OutOfMemory`] if the system refuses a thread.
    pub fn watch<R: Send>(&self, work: impl FnOnce() -> Result<R> + Send) -> Result<R> {
        // Within a pool somebody outside is reporting already.
        if rayon::current_thread_index().is_some() || lock(&self.sink).is_none() {
            return work();
        }
        self.run(&*crate::threads::pool(1)?, work)
    }

    /// Runs `work` that consists of operations with pools of their own while this thread reports to the caller's function. The thread that it
    /// runs on belongs to no pool that they could wait for.
    ///
    /// # Errors
    /// The result of `work`, or [`Error::OutOfMemory`] if the system refuses a thread.
    pub fn watch_operations<R: Send>(&self, work: impl FnOnce() -> Result<R> + Send) -> Result<R> {
        self.run_on(&crate::threads::new(1)?, work)
    }

    /// Runs `work` on `pool` while this thread reports to the caller's function. A caller's function that makes a scan may call us again on
    /// a thread of a pool. The work then runs on as many threads of its own: that thread waits, and might be who is waited for.
    pub fn run<R: Send>(&self, pool: &rayon::ThreadPool, work: impl FnOnce() -> R + Send) -> R {
        if rayon::current_thread_index().is_none() {
            return self.run_on(pool, work);
        }
        match crate::threads::new(pool.current_num_threads()) {
            Ok(own) => self.run_on(&own, work),
            Err(_) => work(),
        }
    }

    fn run_on<R: Send>(&self, pool: &rayon::ThreadPool, work: impl FnOnce() -> R + Send) -> R {
        let mut sink = lock(&self.sink);
        // Not only after the first wait: a caller who wants to stop must be heard however short the work is.
        self.report(&mut sink);
        let finished = (Mutex::new(false), Condvar::new());
        let mut result = None;
        let slot = &mut result;
        pool.in_place_scope(|scope| {
            let finished = &finished;
            scope.spawn(move |_| {
                // Also on a panic, or the calling thread would wait for ever.
                let _signal = SignalOnDrop(finished);
                *slot = Some(work());
            });
            let mut done = lock(&finished.0);
            while !*done {
                done = finished.1.wait_timeout(done, POLL).unwrap_or_else(PoisonError::into_inner).0;
                if *done {
                    break;
                }
                drop(done);
                self.report(&mut sink);
                done = lock(&finished.0);
            }
        });
        result.expect("the scope returns only after its work")
    }

    /// Tells a watcher that has not cancelled that all is done. The answer changes nothing. It is called by whoever began the call, once it
    /// has succeeded.
    pub fn finish(&self) {
        let stage = lock(&self.plan).last().map_or("", |stage| stage.0);
        if let Some(report) = &mut *lock(&self.sink)
            && !self.cancelled.load(Ordering::Relaxed)
        {
            let _ = report(Tick { stage, fraction: 1.0 });
        }
    }

    fn report(&self, sink: &mut Option<Sink<'a>>) {
        let Some(report) = sink else { return };
        // A caller that has said no is not asked again while the work winds up.
        if self.cancelled.load(Ordering::Relaxed) {
            return;
        }
        let mut tick = self.tick();
        let mut highest = lock(&self.highest);
        *highest = highest.max(tick.fraction);
        tick.fraction = *highest;
        drop(highest);
        if report(tick).is_break() {
            self.cancel();
        }
    }
}

/// Entries handled between two checks: a millisecond's work or so.
pub const BLOCK: usize = 1 << 16;
/// Entries sorted between two checks: some 20 milliseconds' work.
const SORTED_AT_ONCE: usize = 1 << 19;

impl Progress<'_> {
    /// `0..len` in blocks, with a check before each.
    ///
    /// # Errors
    /// Each may be [`Error::Cancelled`].
    pub fn ranges(&self, len: usize) -> impl Iterator<Item = Result<Range<usize>>> {
        (0..len).step_by(BLOCK).map(move |first| self.check().map(|()| first..len.min(first + BLOCK)))
    }

    /// Sorts, on the threads of the pool it runs on, in pieces with a check before each. `compare` orders all entries, or
    /// equal ones are the same: their order is not said.
    ///
    /// # Errors
    /// [`Error::Cancelled`]: the entries are in any order then.
    pub fn sort<T: Send>(
        &self,
        entries: &mut [T],
        compare: &(impl Fn(&T, &T) -> std::cmp::Ordering + Sync),
    ) -> Result<()> {
        self.check()?;
        if entries.len() <= SORTED_AT_ONCE {
            entries.par_sort_unstable_by(compare);
            return Ok(());
        }
        let (low, _, high) = entries.select_nth_unstable_by(entries.len() / 2, compare);
        let (low, high) = rayon::join(|| self.sort(low, compare), || self.sort(high, compare));
        low.and(high)
    }

    /// The slice in blocks, with a check before each.
    pub fn blocks<'s, T>(&'s self, entries: &'s [T]) -> impl Iterator<Item = Result<&'s [T]>> {
        self.ranges(entries.len()).map(|range| range.map(|range| &entries[range]))
    }
}

/// Checks once in so much work, where steps differ much in what they cost.
pub struct Pace<'p> {
    progress: &'p dyn Whole,
    done: usize,
}

/// A progress whoever watches it.
trait Whole: Send + Sync {
    fn check(&self) -> Result<()>;
    fn stage(&self, index: usize, total: u64);
    fn count(&self, n: u64);
    fn reach(&self, done: u64);
}

impl Whole for Progress<'_> {
    fn check(&self) -> Result<()> {
        Progress::check(self)
    }

    fn stage(&self, index: usize, total: u64) {
        Progress::stage(self, index, total);
    }

    fn count(&self, n: u64) {
        Progress::count(self, n);
    }

    fn reach(&self, done: u64) {
        Progress::reach(self, done);
    }
}

impl<'p> Pace<'p> {
    /// Checks that progress.
    pub fn new(progress: &'p Progress<'_>) -> Self {
        Pace { progress, done: 0 }
    }

    /// Counts work, in entries looked at.
    ///
    /// # Errors
    /// [`Error::Cancelled`], and again from then on.
    #[inline]
    pub fn after(&mut self, entries: usize) -> Result<()> {
        self.done += entries;
        if self.done >= BLOCK {
            self.progress.check()?;
            self.done = 0;
        }
        Ok(())
    }
}

struct SignalOnDrop<'a>(&'a (Mutex<bool>, Condvar));

impl Drop for SignalOnDrop<'_> {
    fn drop(&mut self) {
        *lock(&self.0.0) = true;
        self.0.1.notify_all();
    }
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests;
