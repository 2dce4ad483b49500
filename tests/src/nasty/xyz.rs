//! Clouds as text.

use super::Expected::{Accepted, Refused};
use super::{Nasty, SQUARE, case};

pub(super) fn cases() -> Vec<Nasty> {
    vec![
        case("blanks.xyz", SQUARE.replace(' ', "\t  "), Accepted(4, 0)),
        case("commas.xyz", SQUARE.replace(' ', ", "), Accepted(4, 0)),
        case("semicolons.csv", SQUARE.replace(' ', ";"), Accepted(4, 0)),
        case("heading.txt", format!("x y z\n{SQUARE}"), Accepted(4, 0)),
        case("heading.xyz", format!("x y z\n{SQUARE}"), Accepted(4, 0)),
        case("remarks.xyz", format!("# a\n// b\n\n{}", SQUARE.replace("1 1 0", "1 1 0 # c")), Accepted(4, 0)),
        case("mark.xyz", format!("\u{feff}{SQUARE}"), Accepted(4, 0)),
        case("ragged.xyz", "0 0 0\n1 0\n", Refused("2 values")),
        case("four.xyz", SQUARE.replace('\n', " 7\n"), Accepted(4, 0)),
        case(
            "ragged_four.xyz",
            "0 0 0 7\n1 0 0 7\n0 1 0\n",
            Refused("3 values in a line, the first one has 4"),
        ),
        case("nan.xyz", format!("{SQUARE}nan 0 0\n"), Accepted(4, 0)),
        case("all_nan.xyz", "nan nan nan\n".repeat(50), Refused("not finite")),
        case("word.xyz", "0 0 0\n1 x 0\n", Refused("is not a number")),
        case("decimal_commas.csv", "0,5;1,5;2,5\n1,5;1,5;2,5\n0,5;2,5;2,5\n", Accepted(3, 0)),
        case("decimal_commas.xyz", "0,5 1,5 2,5\n1,5 1,5 2,5\n0,5 2,5 2\n", Accepted(3, 0)),
        case("tail_commas.csv", SQUARE.replace(' ', ",").replace('\n', ",\n"), Accepted(4, 0)),
        case("three.xyz", "0 0 0\n1 0 0\n0 1 0\n", Accepted(3, 0)),
        case("one.xyz", "5 5 5\n", Refused("single vertex")),
        case("one_place.xyz", "5 5 5\n".repeat(100), Refused("one place")),
        case("seven.pts", SQUARE.replace('\n', " -1200 9 8 7\n"), Accepted(4, 0)),
        case("nine.xyz", SQUARE.replace('\n', " 9 8 7 0 0 1\n"), Accepted(4, 0)),
        case("count_first.pts", format!("4\n{SQUARE}"), Accepted(4, 0)),
        case("count_first.txt", format!("4\r\n{}", SQUARE.replace('\n', " 0.5\r\n")), Accepted(4, 0)),
        case("wrong_count.pts", format!("4000\n{SQUARE}"), Refused("announces 4000 points, 4 follow")),
        case("count_alone.pts", "4\n", Refused("announces 4 points, 0 follow")),
        case("zeros.xyz", "0 0 0\n\0\0\0\n1 1 1\n", Refused("is not a number")),
        case("huge.xyz", "1e308 0 0\n-1e308 0 0\n0 1 0\n", Refused("no object")),
        case("digits.xyz", format!("{} 0 0\n{SQUARE}", "9".repeat(100_000)), Accepted(4, 0)),
        case("one_long_line.xyz", "0 ".repeat(300_000), Refused("300000 values")),
    ]
}
