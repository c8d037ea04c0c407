//! `pipeline bench --ablate`.

use super::{Arguments, for_each_job, with_progress};
use crate::bench::ablation::{Row, ablate, ablation_chart, ablation_csv, ablation_table, renders};
use crate::bench::{Plan, Subject};
use crate::cli::{DIFFERENT, Outcome, Talk, WELL, print};
use crate::imagefile::{encode_png, write_whole};
use crate::job::Build;

pub(super) fn run(arguments: &Arguments, plan: &Plan, talk: Talk) -> Outcome {
    let build = Build::current()?;
    let mut ablations = Vec::new();
    for_each_job(arguments, |job, loaded| {
        let subject = Subject { job, loaded, build: &build };
        ablations.push(with_progress(renders(&subject, plan), talk, |watch| ablate(&subject, plan, watch))?);
        Ok(())
    })?;
    let folder = &arguments.output;
    let (svg, picture) = ablation_chart(&ablations)?;
    write_whole(&folder.join("ablation.csv"), ablation_csv(&ablations)?.as_bytes())?;
    write_whole(&folder.join("ablation.svg"), svg.as_bytes())?;
    write_whole(&folder.join("ablation.png"), &encode_png(picture.width, picture.height, &picture.rgb)?)?;
    print(&ablation_table(&ablations))?;
    talk.say(&format!("chart: {}", folder.join("ablation.png").display()));
    let is_wrong = ablations.iter().flat_map(|ablation| &ablation.rows).any(Row::is_wrong);
    Ok(if is_wrong { DIFFERENT } else { WELL })
}
