//! Ablations as text.

use super::Ablation;
use crate::bench::BenchError;
use crate::bench::table::{columns, ratio, written};

fn yes(is: bool) -> String {
    if is { "yes" } else { "no" }.to_owned()
}

/// All rows, in columns.
pub fn ablation_table(ablations: &[Ablation]) -> String {
    let heads = ["scene", "variant", "what it does", "error", "time", "work", "same bits"];
    let rows: Vec<[String; 7]> = ablations
        .iter()
        .flat_map(|ablation| ablation.rows.iter().map(move |row| (ablation, row)))
        .map(|(ablation, row)| {
            let [error, time, work] = [row.error, row.time, row.work()].map(ratio);
            let same = yes(row.same_bits) + if row.is_wrong() { ", WRONG" } else { "" };
            [ablation.name.clone(), row.name.clone(), row.what.to_owned(), error, time, work, same]
        })
        .collect();
    columns(heads, &rows, 3)
}

/// All rows, with all digits.
///
/// # Errors
/// If the table can't be written.
pub fn ablation_csv(ablations: &[Ablation]) -> Result<String, BenchError> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record([
        "scene",
        "variant",
        "what_it_does",
        "error_ratio",
        "time_ratio",
        "work_ratio",
        "same_bits",
    ])?;
    for ablation in ablations {
        for row in &ablation.rows {
            let ratios = [row.error, row.time, row.work()].map(|ratio| ratio.to_string());
            let words = [ablation.name.clone(), row.name.clone(), row.what.to_owned()];
            writer.write_record(words.into_iter().chain(ratios).chain([yes(row.same_bits)]))?;
        }
    }
    written(writer)
}
