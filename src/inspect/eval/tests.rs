use super::*;

/// A header with all columns that are needed.
const HEADER: &str = "base_color_r,base_color_g,base_color_b,metallic,subsurface,specular,roughness,specular_tint,anisotropic,sheen,sheen_tint,clearcoat,clearcoat_gloss,lx,ly,lz,vx,vy,vz";
/// Lambert's lobe alone, nearly: no highlight, looked at and lit from straight above.
const ROW: &str = "0.5,0.25,1,0,0,0,0.5,0,0,0,0,0,1,0,0,1,0,0,1";

fn run(text: &str) -> (Vec<String>, Summary) {
    let mut out = Vec::new();
    let summary = evaluate(text.as_bytes(), "rows.csv", Variant::default(), &mut out).unwrap();
    (String::from_utf8(out).unwrap().lines().map(str::to_owned).collect(), summary)
}

fn refused(text: &str) -> String {
    let mut out = Vec::new();
    let error = evaluate(text.as_bytes(), "rows.csv", Variant::default(), &mut out).unwrap_err();
    assert!(out.is_empty(), "nothing is written for a file that can't be read");
    error.to_string()
}

/// The row's cell in `column` replaced.
fn row_with(column: &str, value: &str) -> String {
    let cells = HEADER.split(',').zip(ROW.split(','));
    cells.map(|(name, cell)| if name == column { value } else { cell }).collect::<Vec<_>>().join(",")
}

fn results(line: &str) -> Vec<f32> {
    let cells: Vec<&str> = line.split(',').collect();
    cells[cells.len() - 4..].iter().map(|c| c.parse().unwrap()).collect()
}

/// What is wrong with a row in which one cell is replaced.
fn why(column: &str, value: &str) -> String {
    let (lines, summary) = run(&format!("{HEADER}\n{}\n", row_with(column, value)));
    assert!(lines[1].ends_with(",,,,"), "{lines:?}");
    assert_eq!(summary.failures.len(), 1, "{column} = {value}");
    assert_eq!(summary.failures[0].line, 2);
    summary.failures[0].why.clone()
}

#[test]
fn a_row_comes_back_with_its_value_and_density() {
    let (lines, summary) = run(&format!("{HEADER}\n{ROW}\n"));
    assert_eq!(lines[0], format!("{HEADER},fr,fg,fb,pdf"));
    assert!(lines[1].starts_with(&format!("{ROW},")));
    // At normal incidence from and to, Burley's diffuse term is base_color/π.
    let pi = std::f32::consts::PI;
    let values = results(&lines[1]);
    for (is, should) in values.iter().zip([0.5 / pi, 0.25 / pi, 1.0 / pi]) {
        assert!((is / should - 1.0).abs() < 1e-6, "{is} for {should}");
    }
    assert!(values[3] > 0.1 && values[3] < 10.0, "{}", values[3]);
    assert_eq!(summary, Summary { rows: 1, ..Summary::default() });
}

#[test]
fn columns_may_stand_anywhere_under_either_spelling_beside_others() {
    let (straight, _) = run(&format!("{HEADER}\n{ROW}\n"));
    let mut pairs: Vec<(&str, &str)> = HEADER.split(',').zip(ROW.split(',')).collect();
    pairs.reverse();
    let header: Vec<String> = pairs.iter().map(|(n, _)| n.replace("specular_tint", "specularTint")).collect();
    let cells: Vec<&str> = pairs.iter().map(|(_, c)| *c).collect();
    let text = format!("note, {} ,fr\n\"a, b\",{},9\n", header.join(" , "), cells.join(", "));
    let (lines, summary) = run(&text);
    assert_eq!(lines[0], format!("note, {} ,fr,fg,fb,pdf", header.join(" , ")));
    assert!(lines[1].starts_with(&format!("\"a, b\",{},", cells.join(", "))), "{}", lines[1]);
    assert_eq!(results(&lines[1]), results(&straight[1]));
    assert_eq!(summary.compared, 1);
}

#[test]
fn given_values_are_replaced_in_place_and_held_against_ours() {
    let mut out = Vec::new();
    let text = format!("pdf,fr,{HEADER}\n7,0.16,{ROW}\n,,{ROW}\n");
    let summary = evaluate(text.as_bytes(), "rows.csv", Variant::default(), &mut out).unwrap();
    let out = String::from_utf8(out).unwrap();
    let row = out.lines().nth(1).unwrap();
    assert!(!row.starts_with("7,") && row.split(',').nth(1).unwrap().starts_with("0.15915"), "{row}");
    assert_eq!(out.lines().nth(2), Some(row), "an empty cell is filled");
    let worst = summary.worst.unwrap();
    assert_eq!((worst.column, worst.line, summary.compared), ("fr", 2, 1));
    assert!((worst.relative - 0.005_28).abs() < 1e-5, "{}", worst.relative);
}

#[test]
fn each_bad_cell_is_named_with_what_it_must_be() {
    assert_eq!(why("roughness", "1.5"), "column roughness is 1.5, but must be in [0, 1]");
    assert_eq!(why("roughness", "nan"), "column roughness is NaN, but must be in [0, 1]");
    assert_eq!(why("base_color_g", "-0.1"), "column base_color_g is -0.1, but must be in [0, 1]");
    assert_eq!(why("sheen", "much"), "column sheen is \"much\", but must be a number");
    assert_eq!(why("sheen", ""), "column sheen is empty, but must be a number");
    assert_eq!(why("lx", "inf"), "column lx is inf, but must be finite");
    let long = why("lz", "2");
    assert!(long.starts_with("the direction l (lx, ly, lz) has the length 2.000000"), "{long}");
    assert!(why("vz", "0").contains("length 0.000e0"));
    let both = run(&format!("{HEADER}\n{}\n", row_with("roughness", "7").replacen("0.5", "x", 1))).1;
    assert!(
        both.failures[0].why.contains("base_color_r is \"x\"")
            && both.failures[0].why.contains("; column roughness is 7")
    );
}

#[test]
fn bad_rows_keep_their_place_and_lines_are_counted_as_editors_do() {
    for end in ["\n", "\r\n"] {
        let bad = row_with("roughness", "2");
        let text =
            ["", HEADER, ROW, "", "", &bad, ROW, "1,2", "   ", &format!("{ROW},5"), &format!("{ROW},,")];
        let (lines, summary) = run(&text.join(end));
        assert_eq!(summary.rows, 6);
        let failed: Vec<u64> = summary.failures.iter().map(|f| f.line).collect();
        assert_eq!(failed, [6, 8, 10], "{end:?}");
        assert_eq!(summary.failures[1].why, "the row has 2 cells, the header 19");
        assert_eq!(lines.len(), 7);
        let width = lines[0].split(',').count();
        assert!(lines.iter().all(|l| l.split(',').count() == width), "{lines:?}");
        assert_eq!(lines[6], lines[1]);
    }
}

#[test]
fn directions_below_the_horizon_are_black_and_nearly_unit_ones_are_normalised() {
    let (lines, summary) =
        run(&format!("{HEADER}\n{}\n{}\n", row_with("lz", "-1"), row_with("vz", "1.0009")));
    assert_eq!(results(&lines[1]), [0.0; 4]);
    let straight = results(&run(&format!("{HEADER}\n{ROW}\n")).0[1]);
    assert_eq!(results(&lines[2]), straight);
    assert!(summary.failures.is_empty());
}

#[test]
fn a_header_that_lacks_columns_says_which_and_what_is_near() {
    let text = format!("{}\n{ROW}\n", HEADER.replace("roughness", "rougness").replace(",vz", ""));
    assert_eq!(refused(&text), "rows.csv: the header lacks `roughness` (is it `rougness`?), `vz`");
    assert!(refused(&HEADER.replace(',', ";")).contains("separated by ';'"));
    assert!(refused("").contains("is empty") && refused("\n\n").contains("is empty"));
    let twice = refused(&format!("{HEADER},Roughness\n"));
    assert!(twice.contains("columns 7 and 20") && twice.contains("`roughness` and `Roughness`"), "{twice}");
}

#[test]
fn a_byte_order_mark_is_no_part_of_a_name() {
    let (lines, _) = run(&format!("\u{feff}{HEADER}\n{ROW}\n"));
    assert_eq!(lines.len(), 2);
}

#[test]
fn numbers_are_read_back_as_they_were() {
    for value in [0.0, 1.0 / 3.0, 1.234_567_9e-12, 3.1e5, f32::MIN_POSITIVE, 9.9e20] {
        assert_eq!(number(value).parse::<f32>(), Ok(value));
        assert!(number(value).len() < 16, "{}", number(value));
    }
}
