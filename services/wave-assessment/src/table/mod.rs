//! Tables of readings as people write them: what a logger, a spreadsheet or a researcher calls CSV. Text in, columns of numbers out.
//!
//! | question | answer |
//! |---|---|
//! | what separates cells | comma, semicolon, tab, bar or blanks: whichever cuts the lines into equally many cells, most of them |
//! | where does data begin | at the first line whose cells are all readings; a line of words before it names the columns, one below that may give units |
//! | what is no reading | an empty cell, `NaN`, `NA`, `null`, `none`, `-`: missing. Any other text is an error that names its line |
//! | what is the decimal sign | a point; a comma where commas separate nothing |
//! | which column is which | see [`Choice`] |
//!
//! | what is the unit | what the column's name says, or the line below the names; where a name says a unit that is no length, an error. Else metres |
//!
//! Lines that are empty or begin with `#` or `%` are skipped, and so is a byte order mark; above the data such a line may name the columns.

mod cells;
mod choose;
#[cfg(test)]
mod tests;
mod units;

pub use cells::{Table, TableError};
pub use choose::{Choice, ChoiceError, Readings};
pub use units::{LengthUnit, TimeUnit};
