//! Tables of readings as people write them: what a logger, a spreadsheet or a researcher calls CSV. Text in, columns of numbers out.
//!
//! | question | answer |
//! |---|---|
//! | what separates cells | comma, semicolon, tab, bar or blanks: whichever cuts the lines into equally many cells, most of them |
//! | where does data begin | at the first line whose cells are all readings; a line of words before it names the columns |
//! | what is no reading | an empty cell, `NaN`, `NA`, `null`, `none`, `-`: missing. Any other text is an error that names its line |
//! | what is the decimal sign | a point; a comma where commas separate nothing |
//! | which column is which | see [`Choice`] |
//!
//! Lines that are empty or begin with `#` or `%` are skipped, and so is a byte order mark.

mod cells;
mod choose;
#[cfg(test)]
mod tests;

pub use cells::{Table, TableError};
pub use choose::{Choice, ChoiceError, LengthUnit, Readings, TimeUnit};
