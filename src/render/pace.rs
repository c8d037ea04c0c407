//! How many samples a limit of time leaves room for: the last ones are as many as all tiles get in what is left of it, so that none has
//! half as many as the others when it ends.

use std::time::{Duration, Instant};

use super::adaptive::Aim;
use super::tile::Level;

/// This part of the time that is left is counted on.
const COUNTED_ON: f64 = 0.97;
/// Pixels go on for no less than this part of the samples they have: each round costs something too, and if it is more than there is time
/// for, tiles that are not reached lack no more than that.
const LEAST_GAIN: f64 = 1.0 / 16.0;

/// The time a render has, and how fast its samples come.
pub(super) struct Pace {
    deadline: Option<Instant>,
    /// Seconds for a sample of each pixel of a tile, all threads together; none before the first.
    seconds: Option<f64>,
}

impl Pace {
    /// From now on.
    pub(super) fn new(limit: Option<Duration>) -> Self {
        // A deadline beyond all clocks never comes.
        Self { deadline: limit.and_then(|limit| Instant::now().checked_add(limit)), seconds: None }
    }

    pub(super) fn is_over(&self) -> bool {
        self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }

    /// What of the `level` so many tiles whose pixels have `before` samples can reach in time; none when time is up, but the first samples are
    /// always taken. How fast samples came may mislead, as when another program held them up: so it goes on until time is up.
    pub(super) fn reachable(&self, level: Level, before: u32, tiles: usize) -> Option<Level> {
        let (Some(deadline), Some(seconds)) = (self.deadline, self.seconds) else { return Some(level) };
        let left = deadline.saturating_duration_since(Instant::now()).as_secs_f64();
        (!self.is_over()).then(|| cut(level, before, COUNTED_ON * left / (seconds * tiles as f64)))
    }

    /// So many tiles have got so many samples since `start`.
    pub(super) fn took(&mut self, samples: u32, tiles: usize, start: Instant) {
        let count = f64::from(samples) * tiles as f64;
        if count > 0.0 {
            self.seconds = Some(start.elapsed().as_secs_f64() / count);
        }
    }
}

/// The level, or as much of it as `more` samples reach, or the least gain.
fn cut(level: Level, before: u32, more: f64) -> Level {
    let more = more.max(LEAST_GAIN * f64::from(before)).max(1.0);
    if f64::from(before) + more >= f64::from(level.samples) {
        return level;
    }
    let samples = before + more as u32;
    let aim = level.aim.map(|aim| Aim { mean: samples, ..aim });
    // Errors are judged where samples have doubled: looked at more often, they would seem small more often.
    Level { samples, aim, is_looked_at: false, is_judged: false, is_last: false }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn level(samples: u32) -> Level {
        let aim = Some(Aim { spp: 256, first: 16, mean: samples });
        Level { samples, aim, is_looked_at: samples == 16, is_judged: true, is_last: samples == 256 }
    }

    #[test]
    fn a_level_is_reached_as_far_as_time_allows() {
        for (more, reached) in
            [(1e9, 128), (64.0, 128), (63.9, 127), (20.5, 84), (3.9, 68), (0.0, 68), (f64::NAN, 68)]
        {
            let found = cut(level(128), 64, more);
            assert_eq!((found.samples, found.aim.map(|aim| aim.mean)), (reached, Some(reached)), "{more}");
        }
        // Plans are made by what all that they need has seen, and the end is the settings'.
        let part = cut(level(16), 8, 4.0);
        assert_eq!((part.samples, part.is_looked_at, part.is_judged), (12, false, false));
        assert!(!cut(level(256), 128, 100.0).is_last && cut(level(256), 128, 128.0).is_last);
        assert_eq!(cut(level(4), 2, 0.1).samples, 3, "no less than a whole sample");
    }

    #[test]
    fn nothing_is_left_out_without_a_limit_or_before_the_first_samples() {
        let mut pace = Pace::new(Some(Duration::ZERO));
        assert!(pace.is_over());
        assert_eq!(pace.reachable(level(16), 0, 10), Some(level(16)));
        pace.took(16, 10, Instant::now());
        assert_eq!(pace.reachable(level(32), 16, 10), None);
        for limit in [None, Some(Duration::MAX)] {
            let mut pace = Pace::new(limit);
            pace.took(16, 10, Instant::now());
            assert!(!pace.is_over());
            assert_eq!(pace.reachable(level(32), 16, 10), Some(level(32)));
        }
    }
}
