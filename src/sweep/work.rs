//! A sweep under way: jobs that can be rendered together wait for each other.

use std::sync::Arc;

use super::SweepError;
use super::run::{Observer, Options};
use crate::job::{self, Build, Destination, LoadedScene, Ready};
use crate::record::{Job, JobRecord, Outcome};
use crate::render::Control;

/// Unless asked for more, jobs are rendered together as long as they take no more camera paths than this: some minutes' work, which is
/// what a killed run loses.
const MOST_PATHS: u64 = 1 << 29;
/// No more jobs than this wait, in no more groups: each is prepared, and has its lights in memory.
const MOST_WAITING: usize = 32;
const MOST_GROUPS: usize = 4;

/// Jobs with their places, to be rendered together.
type Group = Vec<(usize, Ready)>;

/// What is done and what waits.
pub(super) struct Work<'a> {
    build: &'a Build,
    destination: &'a Destination,
    options: &'a Options,
    pub(super) observer: &'a mut dyn Observer,
    /// Those that came first are first.
    waiting: Vec<Group>,
    records: Vec<(usize, JobRecord)>,
    reused: usize,
}

impl<'a> Work<'a> {
    pub(super) fn new(
        build: &'a Build,
        destination: &'a Destination,
        options: &'a Options,
        observer: &'a mut dyn Observer,
    ) -> Self {
        Self { build, destination, options, observer, waiting: Vec::new(), records: Vec::new(), reused: 0 }
    }

    /// Reuses a job, or lets it wait for others that can be rendered with it, maybe after some that can't.
    pub(super) fn take(
        &mut self,
        index: usize,
        job: &Job,
        loaded: Result<&LoadedScene, String>,
    ) -> Result<(), SweepError> {
        let planned = loaded.and_then(|loaded| {
            let planned = job::plan(job, loaded, self.build).map_err(|error| error.told())?;
            Ok((planned, loaded))
        });
        let (planned, loaded) = match planned {
            Ok(pair) => pair,
            Err(error) => {
                let record = job::failed_record(job, self.build, &self.destination.folder, &error)?;
                return self.add_failed(index, record);
            }
        };
        if !self.options.force
            && let Some(mut record) = job::finished(&planned, &self.destination.folder)
        {
            job::recheck(&mut record, self.destination)?;
            self.add(index, record, true);
            return Ok(());
        }
        match job::prepare(planned, loaded, self.build, self.destination) {
            Ok(ready) => self.wait(index, ready),
            Err(record) => {
                job::write_record(&record, &self.destination.folder)?;
                self.add_failed(index, *record)
            }
        }
    }

    /// A job that can't be rendered: where that ends the sweep, those that came before it are rendered first.
    fn add_failed(&mut self, index: usize, record: JobRecord) -> Result<(), SweepError> {
        if self.options.fail_fast {
            self.render_waiting()?;
        }
        self.add(index, record, false);
        Ok(())
    }

    /// Lets a job wait with those that it can be rendered with; renders these if there can't be more, and the first ones if too many wait.
    fn wait(&mut self, index: usize, ready: Ready) -> Result<(), SweepError> {
        let place = self.waiting.iter().position(|group| self.has_room_for(group, &ready));
        let place = place.unwrap_or_else(|| {
            self.waiting.push(Group::new());
            self.waiting.len() - 1
        });
        let is_full = !self.is_short(&ready, self.waiting[place].len() + 2);
        self.waiting[place].push((index, ready));
        if is_full {
            self.render_group(place)?;
        } else if self.waiting.len() > MOST_GROUPS
            || self.waiting.iter().map(Vec::len).sum::<usize>() > MOST_WAITING
        {
            self.render_group(0)?;
        }
        Ok(())
    }

    /// Whether a job can be rendered with those of a group.
    fn has_room_for(&self, group: &Group, ready: &Ready) -> bool {
        let others: Vec<&Ready> = group.iter().map(|(_, ready)| ready).collect();
        self.is_short(ready, group.len() + 1) && ready.joins(&others)
    }

    /// Whether so many jobs like this one may be rendered together.
    fn is_short(&self, ready: &Ready, count: usize) -> bool {
        match self.options.together {
            Some(most) => count <= most.get(),
            None => ready.paths().saturating_mul(count as u64) <= MOST_PATHS,
        }
    }

    /// Renders the jobs that wait.
    pub(super) fn render_waiting(&mut self) -> Result<(), SweepError> {
        while !self.waiting.is_empty() {
            self.render_group(0)?;
        }
        Ok(())
    }

    fn render_group(&mut self, place: usize) -> Result<(), SweepError> {
        let group = self.waiting.remove(place);
        if self.is_over() {
            return Ok(());
        }
        let ready: Vec<&Ready> = group.iter().map(|(_, ready)| ready).collect();
        let jobs: Vec<&Job> = ready.iter().map(|ready| ready.job()).collect();
        let control = Arc::new(Control::default());
        self.observer.started(&jobs, &control);
        let records = job::run_together(&ready, self.build, self.destination, &control)?;
        for ((index, _), record) in group.iter().zip(records) {
            self.add(*index, record, false);
        }
        Ok(())
    }

    fn add(&mut self, index: usize, record: JobRecord, reused: bool) {
        self.observer.finished(&record, reused);
        self.reused += usize::from(reused);
        self.records.push((index, record));
    }

    /// A job has failed, and that was to end the sweep.
    pub(super) fn is_over(&self) -> bool {
        let has_failed = |(_, record): &(usize, JobRecord)| matches!(record.outcome, Outcome::Failed { .. });
        self.options.fail_fast && self.records.iter().any(has_failed)
    }

    /// Renders what still waits; the result is all records in the order of the jobs, and how many were reused.
    pub(super) fn end(mut self) -> Result<(Vec<JobRecord>, usize), SweepError> {
        self.render_waiting()?;
        self.records.sort_by_key(|(index, _)| *index);
        Ok((self.records.into_iter().map(|(_, record)| record).collect(), self.reused))
    }
}
