//! Progress bars, on a terminal alone.

use std::io::IsTerminal;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use super::Talk;
use crate::render::Control;

/// Steps of the bar a job has: its samples move it smoothly.
const STEPS: u64 = 1000;
/// Characters of a job's name that the bar shows.
const LONGEST_NAME: usize = 32;
/// Between two looks at a running render.
const INTERVAL: Duration = Duration::from_millis(100);

/// A bar over some jobs, which follows the samples of the one that runs.
pub(super) struct Progress {
    bar: ProgressBar,
    jobs: usize,
    /// Jobs that are done, reused ones included.
    seen: usize,
    /// Jobs that were rendered.
    done: u64,
    follower: Option<Follower>,
}

/// How much of `whole` has passed, at most 1.
fn share(passed: Duration, whole: Duration) -> f64 {
    let share = passed.as_secs_f64() / whole.as_secs_f64();
    if share < 1.0 { share } else { 1.0 }
}

struct Follower {
    stop: Arc<AtomicBool>,
    thread: JoinHandle<()>,
}

impl Progress {
    /// A bar for `jobs` jobs; nothing is shown if stderr is not a terminal or nothing is to be said.
    pub(super) fn new(jobs: usize, talk: Talk) -> Self {
        let shown = talk == Talk::Normal && std::io::stderr().is_terminal();
        let bar = if shown { ProgressBar::new(jobs as u64 * STEPS) } else { ProgressBar::hidden() };
        let template = "{prefix} {wide_bar} {percent:>3}%, {msg}, {eta} left";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style.progress_chars("━╸─"));
        }
        Self { bar, jobs, seen: 0, done: 0, follower: None }
    }

    /// Follows a render of the named jobs until [`Self::finish_job`].
    pub(super) fn follow(&mut self, names: &[&str], control: &Arc<Control>) {
        if self.bar.is_hidden() {
            return;
        }
        let (first, last) = (self.seen + 1, self.seen + names.len());
        let numbers = if names.len() == 1 { first.to_string() } else { format!("{first}–{last}") };
        let name: String =
            names.first().into_iter().flat_map(|name| name.chars()).take(LONGEST_NAME).collect();
        let more = if names.len() == 1 { "" } else { " …" };
        self.bar.set_prefix(format!("{numbers}/{} {name}{more}", self.jobs));
        let jobs = names.len() as u64;
        let stop = Arc::new(AtomicBool::new(false));
        let (bar, control, done, stopped) =
            (self.bar.clone(), Arc::clone(control), self.done, Arc::clone(&stop));
        let start = Instant::now();
        let thread = std::thread::spawn(move || {
            while !stopped.load(Ordering::Relaxed) {
                let (paths, total) =
                    (control.paths.load(Ordering::Relaxed), control.total_paths.load(Ordering::Relaxed));
                if let Some(steps) = (paths.min(total) * STEPS).checked_div(total) {
                    // What ends first: the samples or the time.
                    let passed = control.time_limit.map_or(0.0, |limit| share(start.elapsed(), limit));
                    let steps = steps.max((passed * STEPS as f64) as u64);
                    bar.set_position(done * STEPS + steps * jobs);
                    let [paths, total] = [paths, total].map(|count| count as f64 * 1e-6);
                    bar.set_message(match control.time_limit {
                        None => format!("{paths:.1}/{total:.1} M samples"),
                        Some(_) => format!("{paths:.1} M samples"),
                    });
                }
                std::thread::park_timeout(INTERVAL);
            }
        });
        self.follower = Some(Follower { stop, thread });
    }

    /// A job is done. Work that was not done now does not count for the time left.
    pub(super) fn finish_job(&mut self, reused: bool) {
        self.stop_following();
        self.seen += 1;
        if reused {
            self.bar.dec_length(STEPS);
        } else {
            self.done += 1;
            // Others that were rendered with it may be as far already.
            self.bar.set_position(self.bar.position().max(self.done * STEPS));
        }
    }

    /// A line above the bar.
    pub(super) fn say(&self, talk: Talk, text: &str) {
        self.bar.suspend(|| talk.say(text));
    }

    fn stop_following(&mut self) {
        if let Some(Follower { stop, thread }) = self.follower.take() {
            stop.store(true, Ordering::Relaxed);
            thread.thread().unpark();
            // It only draws; if that failed there is nothing to add.
            let _ = thread.join();
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.stop_following();
        self.bar.finish_and_clear();
    }
}
