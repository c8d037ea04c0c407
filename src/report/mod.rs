//! Contact sheets, tables and pages: records and pictures in, pixels and text out. Nothing here reads or writes a file.
//!
//! [`arrange`] lays the jobs of a sweep out as a [`Sheet`]: columns × rows, further axes as pages. [`draw_png`] draws a page of it
//! for the eye, [`draw_linear`] the same in linear light with the pictures' values untouched. [`verdict_table`] is the table of
//! the terminal and [`html`] the page of the browser.

mod canvas;
pub(crate) mod chart;
mod draw;
pub(crate) mod font;
mod layout;

mod page;
mod picture;
#[cfg(test)]
mod samples;
mod sheet;
mod table;

pub use canvas::Area;
pub use chart::ChartError;
pub use draw::{draw_linear, draw_png, picture_area};
pub use font::FontError;
pub use page::{PageError, PageInput, PageJob, SheetFile, html};
pub use picture::Picture;
pub use sheet::{Cell, Entry, Heading, Level, Mark, Page, Plan, Sheet, SheetError, arrange};
pub use table::{Summary, TableOptions, verdict_table};
