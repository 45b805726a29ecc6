//! The table of phases, read from the file that the pilot flies and that analysis reads.

const TABLE: &str = include_str!("../../../core/flockwire_core/pilot/transitions.csv");

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Phase {
    Grounded,
    Ready,
    TakeOff,
    Hold,
    Formation,
    Landing,
    Stopped,
}

const NAMES: [(&str, Phase); 7] = [
    ("grounded", Phase::Grounded),
    ("ready", Phase::Ready),
    ("take-off", Phase::TakeOff),
    ("hold", Phase::Hold),
    ("formation", Phase::Formation),
    ("landing", Phase::Landing),
    ("stopped", Phase::Stopped),
];

impl Phase {
    pub fn in_flight(self) -> bool {
        matches!(self, Phase::TakeOff | Phase::Hold | Phase::Formation | Phase::Landing)
    }
}

/// The conditions of the table, a bit each.
pub const CONDITIONS: [&str; 10] =
    ["stop", "airborne", "high", "unready", "disturbed", "danger", "up", "outdated", "formation", "landing"];

pub fn condition(name: &str) -> u16 {
    let place = CONDITIONS.iter().position(|known| *known == name);
    1 << place.unwrap_or_else(|| panic!("transitions.csv: there is no condition {name}"))
}

/// The next phase, by phase and by the conditions that hold.
#[derive(Clone)]
pub struct Table(Vec<[Phase; 1 << CONDITIONS.len()]>);

impl Table {
    pub fn read() -> Table {
        let mut table = vec![[Phase::Stopped; 1 << CONDITIONS.len()]; NAMES.len()];
        let rows: Vec<Vec<&str>> = TABLE.lines().skip(1).map(|line| line.split(',').collect()).collect();
        for (name, phase) in NAMES {
            for conditions in 0..1u16 << CONDITIONS.len() {
                let row = rows.iter().find(|row| applies(row, name, conditions)).expect("a row for each case");
                let next = NAMES.iter().find(|(after, _)| *after == row[2]).expect("a phase");
                table[phase as usize][conditions as usize] = next.1;
            }
        }
        Table(table)
    }

    pub fn next(&self, phase: Phase, conditions: u16) -> Phase {
        self.0[phase as usize][conditions as usize]
    }
}

fn applies(row: &[&str], phase: &str, conditions: u16) -> bool {
    (row[0] == "*" || row[0].split(' ').any(|name| name == phase))
        && row[1].split_whitespace().all(|name| match name.strip_prefix('!') {
            Some(absent) => conditions & condition(absent) == 0,
            None => conditions & condition(name) != 0,
        })
}
