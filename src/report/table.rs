//! The jobs and their verdicts as text, for a terminal or a file.

use std::fmt;

use comfy_table::{Cell, CellAlignment, ContentArrangement, LineStyle, Table, presets};

use crate::record::{JobRecord, Outcome, Verdict};

/// How the table is made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TableOptions {
    /// Columns of the terminal; job names are wrapped to fit. As wide as it needs to be where absent, as for a file or a pipe.
    pub width: Option<u16>,
    /// How many of the jobs were taken from an earlier run.
    pub reused: usize,
}

/// One row a job, then the reason of everything that did not pass, then a line that counts: plain text without colours, which
/// ends in a line break. Control characters in names and errors are shown as spaces.
pub fn verdict_table(records: &[&JobRecord], options: &TableOptions) -> String {
    let mut table = Table::new();
    let rule = LineStyle::none().fill('─').junction('─');
    table.load_style(presets::NOTHING.header_separator(rule));
    table.set_header(["job", "result", "max error", "mean error", "spp", "seconds", "warnings"]);
    for record in records {
        table.add_row(row(record));
    }
    for column in table.column_iter_mut().skip(2) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    if let Some(width) = options.width {
        table.set_content_arrangement(ContentArrangement::Dynamic).set_width(width);
    }
    let mut text = String::new();
    if !records.is_empty() {
        text.push_str(&table.trim_fmt());
        text.push_str("\n\n");
    }
    for record in records {
        if let Some(reason) = reason(record) {
            text.push_str(&format!(
                "{}: {}: {}\n",
                printable(&record.job.name),
                word(record),
                printable(reason)
            ));
        }
    }
    text.push_str(&format!("{}\n", Summary::of(records, options.reused)));
    text
}

fn row(record: &JobRecord) -> Vec<Cell> {
    let (max, mean) =
        errors(&record.verdict).map_or_else(Default::default, |[max, mean]| (figure(max), figure(mean)));
    [
        printable(&record.job.name),
        word(record).to_owned(),
        max,
        mean,
        record.job.settings.spp.to_string(),
        format!("{:.1}", seconds(record)),
        if record.warnings.is_empty() { String::new() } else { record.warnings.len().to_string() },
    ]
    .map(Cell::new)
    .into()
}

/// One or two words: how the job ended or, where it did well, how it stands against its reference.
pub(crate) fn word(record: &JobRecord) -> &'static str {
    match record.outcome {
        Outcome::Failed { .. } => "FAILED",
        Outcome::Done => record.verdict.word(),
    }
}

/// Why the job or its verdict did not pass.
pub(crate) fn reason(record: &JobRecord) -> Option<&str> {
    match (&record.outcome, &record.verdict) {
        (Outcome::Failed { error }, _) => Some(error),
        (Outcome::Done, Verdict::Differs { why, .. } | Verdict::Shape { why } | Verdict::Error { why }) => {
            Some(why)
        }
        (Outcome::Done, Verdict::MissingReference { path }) => Some(path),
        (Outcome::Done, Verdict::Same | Verdict::Within { .. } | Verdict::NotCompared) => None,
    }
}

/// The largest and the mean difference, where there was a comparison of values.
pub(crate) fn errors(verdict: &Verdict) -> Option<[f64; 2]> {
    match *verdict {
        Verdict::Same => Some([0.0, 0.0]),
        Verdict::Within { max_error, mean_error } | Verdict::Differs { max_error, mean_error, .. } => {
            Some([max_error, mean_error])
        }
        _ => None,
    }
}

/// The seconds of all steps.
pub(crate) fn seconds(record: &JobRecord) -> f64 {
    let t = &record.timings;
    t.prepare + t.render + t.output
}

/// A difference with three figures or so.
pub(crate) fn figure(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        size if size < 1e-4 => format!("{value:.1e}"),
        size if size < 10.0 => format!("{value:.5}"),
        size if size < 1e6 => format!("{value:.1}"),
        _ => format!("{value:.2e}"),
    }
}

/// Text without control characters, which would reach the terminal as commands.
fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect::<String>().trim().to_owned()
}

/// How many jobs came to which end. Its text is the last line of the table: `11 jobs: 9 rendered, 2 reused, 11 same`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Summary {
    /// All of them.
    pub jobs: usize,
    /// Done in this run.
    pub rendered: usize,
    /// Done in an earlier run.
    pub reused: usize,
    /// Not done.
    pub failed: usize,
    /// Equal to the reference.
    pub same: usize,
    /// Within the limits.
    pub within: usize,
    /// Beyond the limits, or of another shape.
    pub differ: usize,
    /// Without the reference that there should be.
    pub no_reference: usize,
    /// Done, but the comparison could not be made.
    pub not_comparable: usize,
}

impl Summary {
    /// Counts the records, `reused` of them being from an earlier run.
    pub fn of(records: &[&JobRecord], reused: usize) -> Self {
        let mut sum = Self { jobs: records.len(), ..Self::default() };
        for record in records {
            match (&record.outcome, &record.verdict) {
                (Outcome::Failed { .. }, _) => sum.failed += 1,
                (Outcome::Done, Verdict::Same) => sum.same += 1,
                (Outcome::Done, Verdict::Within { .. }) => sum.within += 1,
                (Outcome::Done, Verdict::Differs { .. } | Verdict::Shape { .. }) => sum.differ += 1,
                (Outcome::Done, Verdict::MissingReference { .. }) => sum.no_reference += 1,
                (Outcome::Done, Verdict::Error { .. }) => sum.not_comparable += 1,
                (Outcome::Done, Verdict::NotCompared) => {}
            }
        }
        let done = sum.jobs - sum.failed;
        sum.reused = reused.min(done);
        sum.rendered = done - sum.reused;
        sum
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let noun = if self.jobs == 1 { "job" } else { "jobs" };
        write!(f, "{} {noun}: {} rendered, {} reused", self.jobs, self.rendered, self.reused)?;
        for (count, what) in [
            (self.failed, "FAILED"),
            (self.same, "same"),
            (self.within, "within limits"),
            (self.differ, "DIFFER"),
            (self.no_reference, "without a reference"),
            (self.not_comparable, "not comparable"),
        ] {
            if count > 0 {
                write!(f, ", {count} {what}")?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::samples::record;

    #[test]
    fn the_table_has_a_row_for_each_job_and_a_count() {
        let records = [
            record("roughness=0.0", Outcome::Done, Verdict::Same),
            record("roughness=0.5", Outcome::Done, Verdict::Within { max_error: 0.0012, mean_error: 3.2e-5 }),
            record("roughness=1.0", Outcome::Done, Verdict::NotCompared),
        ];
        let text =
            verdict_table(&records.iter().collect::<Vec<_>>(), &TableOptions { width: None, reused: 1 });
        insta::assert_snapshot!(text, @"
         job             result          max error   mean error   spp   seconds   warnings
        ───────────────────────────────────────────────────────────────────────────────────
         roughness=0.0   same                    0            0    64       4.0          1
         roughness=0.5   within limits     0.00120       3.2e-5    64       4.0          1
         roughness=1.0   not compared                              64       4.0          1

        3 jobs: 2 rendered, 1 reused, 1 same, 1 within limits
        ");
    }

    #[test]
    fn what_went_wrong_is_told_with_its_reason() {
        let failed = Outcome::Failed { error: "cannot read wood.png:\n\u{1b}[31mno such file".to_owned() };
        let differs =
            Verdict::Differs { max_error: 1.5, mean_error: 0.02, why: "3 pixels over 0.004".to_owned() };
        let records = [
            record("a", failed, Verdict::NotCompared),
            record("b", Outcome::Done, differs),
            record("c", Outcome::Done, Verdict::Shape { why: "4 × 4 against 5 × 4".to_owned() }),
            record("d", Outcome::Done, Verdict::MissingReference { path: "refs/d.exr".to_owned() }),
            record("e", Outcome::Done, Verdict::Error { why: "idiff disagrees".to_owned() }),
        ];
        let text = verdict_table(&records.iter().collect::<Vec<_>>(), &TableOptions::default());
        assert!(text.contains("a: FAILED: cannot read wood.png:  [31mno such file\n"), "{text}");
        assert!(text.contains("b: DIFFERS: 3 pixels over 0.004\n"));
        assert!(text.contains("d: NO REFERENCE: refs/d.exr\n"));
        let last =
            "5 jobs: 4 rendered, 0 reused, 1 FAILED, 2 DIFFER, 1 without a reference, 1 not comparable\n";
        assert!(text.ends_with(last), "{text}");
        assert!(!text.contains('\u{1b}'));
    }

    #[test]
    fn a_narrow_terminal_wraps_long_names() {
        let name = "roughness=0.30,base_color=copper,metallic=1.00,clearcoat=0.50";
        let records = [record(name, Outcome::Done, Verdict::Same)];
        let refs: Vec<_> = records.iter().collect();
        let narrow = verdict_table(&refs, &TableOptions { width: Some(80), reused: 0 });
        assert!(narrow.lines().all(|line| line.chars().count() <= 80), "{narrow}");
        let wide = verdict_table(&refs, &TableOptions::default());
        assert!(wide.contains(name));
    }

    #[test]
    fn no_jobs_are_counted_too() {
        assert_eq!(verdict_table(&[], &TableOptions::default()), "0 jobs: 0 rendered, 0 reused\n");
    }
}
