//! What the columns of a CSV file mean.

use std::path::Path;
use std::str::FromStr;

use crate::batch::Values;
use crate::error::{Error, Result, listed, quoted};

/// The roles of columns: the name of the curve, the point, its parameter and weight, its
/// constraints, whether the curve is closed.
pub(super) const ROLES: [&str; 20] = [
    "curve",
    "x",
    "y",
    "z",
    "t",
    "weight",
    "tx",
    "ty",
    "tz",
    "kx",
    "ky",
    "kz",
    "nu",
    "known",
    "pinned",
    "kmax",
    "corridor",
    "corridor_left",
    "corridor_right",
    "closed",
];

/// The column that says how the fit of a curve ended. It is written, and no role of a column.
pub(super) const STATUS: &str = "status";

/// Columns that can only be x, in a file with a latitude and without a column `x` or `y`.
const LONGITUDES: [&str; 4] = ["lon", "long", "lng", "longitude"];
const LATITUDES: [&str; 2] = ["lat", "latitude"];

/// Columns of race tracks as the Technical University of Munich writes them, and their roles.
const OF_TRACKS: [(&str, &str); 4] =
    [("x_m", "x"), ("y_m", "y"), ("w_tr_right_m", "corridor_right"), ("w_tr_left_m", "corridor_left")];

fn is_one_of(heading: &str, words: &[&str]) -> bool {
    words.iter().any(|word| heading.eq_ignore_ascii_case(word))
}

/// Which column of a CSV file means what: `x=lon,y=lat,curve=id,t=hours`.
///
/// - A column named by its meaning (`curve x y z t weight tx ty tz kx ky kz nu known pinned kmax
///   corridor corridor_left corridor_right closed`) needs no entry. `X` means `x` if no column is called `x`, and so on.
/// - A column `lon`, `long`, `lng` or `longitude` is x, and one called `lat` or `latitude` is y, if
///   the file has both and neither `x` nor `y`.
/// - Columns `x_m`, `y_m`, `w_tr_right_m` and `w_tr_left_m`, as race tracks have them, are x, y and
///   the widths of the corridor. A `#` before the header is left out.
/// - Numbers, such as `x=2,y=3`, are columns counted from 1, where they are not all headings. The
///   file then needs no header.
/// - `weight=`, with nothing after it, drops a column.
/// - If any entry is given, columns without a meaning are dropped. If none is given, such columns
///   are an error that names them. So a misspelt name is not passed over. Only `status`, which
///   faircurve writes, is.
///
/// ```
/// let columns: faircurve::io::Columns = "x=lon,y=lat,curve=id,t=hours".parse()?;
/// # Ok::<(), faircurve::Error>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Columns {
    entries: Vec<(usize, Option<String>)>,
}

impl FromStr for Columns {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let mut entries: Vec<(usize, Option<String>)> = Vec::new();
        for entry in text.split(',').map(str::trim).filter(|entry| !entry.is_empty()) {
            let Some((role, column)) = entry.split_once('=') else {
                return Err(Error::Argument(format!(
                    "columns: {} has no \"=\": write what it means, \"=\", and the column's name, as in x=lon",
                    quoted(entry)
                )));
            };
            let Some(role) = ROLES.iter().position(|known| *known == role.trim()) else {
                return Err(Error::Argument(format!(
                    "columns: there is no {} in {}: {} are possible",
                    quoted(role.trim()),
                    quoted(entry),
                    ROLES.join(", ")
                )));
            };
            if entries.iter().any(|(other, _)| *other == role) {
                return Err(Error::Argument(format!("columns: {} is given twice: once is enough", ROLES[role])));
            }
            let column = column.trim();
            entries.push((role, (!column.is_empty()).then(|| column.to_string())));
        }
        Ok(Columns { entries })
    }
}

/// Which columns of a CSV file travel along, though no method knows them: `all`, or names.
///
/// They become [columns](crate::CurveBatch::columns) of the batch. Numbers are quantities, which
/// are interpolated, unless they are the same in all rows of each curve. By default none are
/// carried.
///
/// What stands after a name says what is between two points: `speed:linear`, `scale:smooth`,
/// `drift:angle` and `turn:angle:smooth`, which go the short way round, in degrees, or
/// `status:nearest`, which makes texts of numbers. Columns called `COG`, `course` or `heading` are
/// angles by themselves, and other numbers linear.
///
/// ```
/// let carried: faircurve::io::Carried = "speed,status:nearest".parse()?;
/// # Ok::<(), faircurve::Error>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Carried {
    all: bool,
    names: Vec<(String, Between)>,
    /// Columns that are carried if they are there.
    optional: &'static [&'static str],
}

/// What a carried column has between two data points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Between {
    /// A number in proportion to the time.
    Linear,
    /// An angle on the short way round.
    Angle,
    /// The same, smoothly.
    Smooth,
    SmoothAngle,
    /// The entry of the nearer of both.
    Nearest,
}

/// Columns that are angles in degrees by their name.
const ANGLES: [&str; 3] = ["cog", "course", "heading"];

impl Between {
    /// That of a column where nothing else is asked for.
    pub(super) fn by_name(name: &str) -> Self {
        if is_one_of(name, &ANGLES) { Between::Angle } else { Between::Linear }
    }

    /// The name of a column, and what follows it.
    fn of(entry: &str) -> (&str, Self) {
        match entry.rsplit_once(':') {
            Some((name, "nearest")) => (name, Between::Nearest),
            Some((name, "linear")) => (name, Between::Linear),
            Some((name, "angle")) => (name, Between::Angle),
            Some((name, "smooth")) => match Between::of(name) {
                (name, Between::Angle | Between::SmoothAngle) => (name, Between::SmoothAngle),
                (name, _) => (name, Between::Smooth),
            },
            _ => (entry, Between::by_name(entry)),
        }
    }

    /// Numbers as values of this kind.
    pub(super) fn values(self, numbers: Vec<f64>) -> Values {
        match self {
            Between::Linear => Values::Numbers(numbers),
            Between::Angle => Values::Angles(numbers),
            Between::Smooth => Values::Smooth(numbers),
            Between::SmoothAngle => Values::SmoothAngles(numbers),
            Between::Nearest => Values::Texts(numbers.iter().map(f64::to_string).collect()),
        }
    }
}

impl FromStr for Carried {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let mut carried = Carried::default();
        for entry in text.split(',').map(str::trim).filter(|entry| !entry.is_empty()) {
            let (name, between) = Between::of(entry);
            if name == "all" {
                carried.all = true;
            } else {
                carried.names.push((name.to_string(), between));
            }
        }
        if !carried.all && carried.names.is_empty() {
            return Err(Error::argument(
                "no column is named to be carried: give all, or names, as in speed,status:nearest",
            ));
        }
        Ok(carried)
    }
}

impl Carried {
    /// These columns and others. What this says of a column that both name is taken.
    pub fn and(mut self, other: Carried) -> Self {
        self.all |= other.all;
        self.names.extend(other.names);
        self
    }

    /// These columns, and others of which a file may lack some.
    #[doc(hidden)]
    pub fn with_optional(mut self, names: &'static [&'static str]) -> Self {
        self.optional = names;
        self
    }

    /// Whether a column is named.
    pub(super) fn names(&self, name: &str) -> bool {
        self.names.iter().any(|(own, _)| own == name)
    }

    /// Whether a column of this name is carried, and how.
    pub(super) fn how(&self, name: &str) -> Option<Between> {
        let own = self.names.iter().find(|(own, _)| own == name).map(|(_, between)| *between);
        own.or((self.all || self.optional.contains(&name)).then(|| Between::by_name(name)))
    }

    /// Those of a header that are carried, as far as they have no role: cell, name, and how.
    pub(super) fn among<'a>(&self, table: &Table, header: &'a [String]) -> Vec<(usize, &'a str, Between)> {
        let free = header.iter().enumerate().filter(|(cell, _)| !table.cells.contains(&Some(*cell)));
        free.filter_map(|(cell, name)| Some((cell, &**name, self.how(name)?))).collect()
    }
}

/// The place of each role in a row.
#[derive(Clone, Copy)]
pub(super) struct Table {
    cells: [Option<usize>; ROLES.len()],
    /// Whether x is a longitude.
    pub longitude: bool,
    /// Whether the column `status` is passed over, in which earlier fits said how they ended.
    pub passes_status: bool,
}

impl Table {
    /// The cell that holds a role.
    pub fn cell(&self, role: &str) -> Option<usize> {
        self.cells[ROLES.iter().position(|known| *known == role).expect("a role of the list")]
    }
}

impl Columns {
    /// Whether no entry is given.
    pub(super) fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Whether columns are named by numbers, counted from 1, that are not all headings.
    pub(super) fn are_numbers(&self, header: &[String]) -> bool {
        let is_number = |column: &String| column.parse().is_ok_and(|number| (1..=header.len()).contains(&number));
        let mut named = self.entries.iter().filter_map(|(_, column)| column.as_ref());
        named.clone().all(is_number) && named.any(|column| !header.contains(column))
    }

    /// The number of a role's column, where columns are named by numbers.
    pub(super) fn number_of(&self, role: &str) -> Option<usize> {
        let column = self.entries.iter().find(|(entry, _)| ROLES[*entry] == role)?.1.as_ref()?;
        column.parse().ok().filter(|number| *number > 0)
    }

    /// Whether the role was dropped with `role=`.
    pub(super) fn drops(&self, role: &str) -> bool {
        self.entries.iter().any(|(entry, column)| ROLES[*entry] == role && column.is_none())
    }

    /// Finds the columns in a header, which stands in this line.
    pub(super) fn resolve(&self, file: &Path, line: u64, header: &[String], carried: &Carried) -> Result<Table> {
        let wrong = |message: String| Err(Error::parse(file, line, message));
        let all = |names: &[String]| listed(names.iter().map(|name| quoted(name)));
        let mut cells = [None; ROLES.len()];
        for (role, name) in ROLES.iter().enumerate() {
            let given = self.entries.iter().find(|(entry, _)| *entry == role).map(|(_, column)| column.as_deref());
            let Some(column) = given.unwrap_or(Some(*name)) else { continue };
            let find = |is: &dyn Fn(&str) -> bool| -> Vec<usize> {
                header.iter().enumerate().filter(|(_, heading)| is(heading)).map(|(cell, _)| cell).collect()
            };
            let mut found = find(&|heading| heading == column);
            if found.is_empty() {
                found = find(&|heading| heading.eq_ignore_ascii_case(column));
            }
            if found.is_empty() && given.is_none() {
                found = find(&|heading| OF_TRACKS.contains(&(heading, name)));
            }
            cells[role] = found.first().copied();
            if found.len() > 1 {
                return wrong(format!("two columns are called {}: rename one of them", quoted(column)));
            }
            if cells[role].is_none() && given.is_some() {
                return wrong(format!(
                    "there is no column {} for {name}: the columns are {}",
                    quoted(column),
                    all(header)
                ));
            }
        }
        let [x, y] = ["x", "y"].map(|name| ROLES.iter().position(|role| *role == name).expect("a role of the list"));
        if cells[x].is_none() && cells[y].is_none() && !self.entries.iter().any(|(role, _)| [x, y].contains(role)) {
            let only = |words: &[&str]| {
                let mut found = header.iter().enumerate().filter(|(_, heading)| is_one_of(heading, words));
                found.next().filter(|_| found.next().is_none()).map(|(cell, _)| cell)
            };
            if let (Some(longitude), Some(latitude)) = (only(&LONGITUDES), only(&LATITUDES)) {
                (cells[x], cells[y]) = (Some(longitude), Some(latitude));
            }
        }
        let table = Table { cells, longitude: false, passes_status: false };
        if let Some((name, _)) = carried.names.iter().find(|(name, _)| !header.contains(name)) {
            return wrong(format!("there is no column {} to carry: the columns are {}", quoted(name), all(header)));
        }
        let along = carried.among(&table, header);
        let unknown = header
            .iter()
            .enumerate()
            .filter(|(cell, _)| !cells.contains(&Some(*cell)) && !along.iter().any(|(carried, ..)| carried == cell));
        let (statuses, unknown): (Vec<String>, Vec<String>) =
            unknown.map(|(_, heading)| heading.clone()).partition(|heading| heading == STATUS);
        if self.entries.is_empty() && carried.names.is_empty() && !unknown.is_empty() {
            let separator = if header.len() == 1 { "separate columns by commas; " } else { "" };
            return wrong(format!(
                "unknown columns {}: {separator}map them with `ReadOptions::columns`, as in x=lon,y=lat (which drops the \
                 others), or carry them (`ReadOptions::carried`); known are {}",
                all(&unknown),
                ROLES.join(", ")
            ));
        }
        for needed in ["x", "y"] {
            if table.cell(needed).is_none() {
                return wrong(format!(
                    "there is no column {needed}: the columns are {}; map one with `ReadOptions::columns`, as in {needed}=…",
                    all(header)
                ));
            }
        }
        for vector in ["t", "k"] {
            let [x, y, z] = ["x", "y", "z"].map(|axis| table.cell(&format!("{vector}{axis}")).is_some());
            let whole = x && y && z == table.cell("z").is_some();
            if (x || y || z) && !whole {
                let wanted = if table.cell("z").is_some() { "x, y and z" } else { "x and y" };
                return wrong(format!(
                    "the columns {vector}x, {vector}y, {vector}z do not fit the points: give {vector} for {wanted}"
                ));
            }
        }
        let longitude = cells[x].is_some_and(|cell| is_one_of(&header[cell], &LONGITUDES));
        Ok(Table { longitude, passes_status: !statuses.is_empty(), ..table })
    }
}
