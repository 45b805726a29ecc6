//! Which order holds: pilot/orders.py, and ground/order_log.py. Sets of orders are bits: of order k the bit k.

use crate::protocol::Bug;

pub const MOST: usize = 8; // orders

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Verb {
    TakeOff,
    Start,
    Formation,
    Hold,
    Land,
}

impl Verb {
    pub fn rank(self) -> i8 {
        match self {
            Verb::Land => 2,
            Verb::Hold => 1,
            _ => 0,
        }
    }

    pub fn takes_off(self) -> bool {
        matches!(self, Verb::TakeOff | Verb::Start)
    }
}

/// `rightful` and `informed` are not part of the protocol: the holds and landings that its giver may end, for they came
/// before it asked; and whether its giver knew a landing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Order {
    pub verb: Verb,
    pub giver: u8,
    pub number: u8, // of the log that it was made from
    pub rightful: u8,
    pub informed: bool,
}

pub fn bit(order: u8) -> u8 {
    1 << order
}

/// Return the order in force by the log: a hold cancels no landing.
pub fn in_force(log: &[u8], all: &[Order]) -> Option<u8> {
    log.iter().fold(None, |held: Option<u8>, k| {
        let (rank, was) = (all[*k as usize].verb.rank(), held.map_or(-1, |k| all[k as usize].verb.rank()));
        if 0 < rank && rank < was { held } else { Some(*k) }
    })
}

/// The orders that one pilot has received. `down` is not part of the protocol: the holds and landings that it obeyed.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Orders {
    pub holds: Option<u8>,
    logged: Option<u8>,
    numbered: u8, // the orders in the log, as received last
    number: u8,
    unnumbered: Vec<u8>, // by arrival
    pub down: u8,
}

impl Orders {
    pub fn received(&self, order: u8) -> bool {
        self.numbered & bit(order) != 0 || self.unnumbered.contains(&order)
    }

    /// Receive the order in force by this part of the log.
    pub fn read(&mut self, log: &[u8], all: &[Order]) {
        if log.len() as u8 <= self.number {
            return;
        }
        (self.number, self.logged) = (log.len() as u8, in_force(log, all));
        self.numbered = log.iter().fold(0, |found, k| found | bit(*k));
        let mut highest = -1;
        for k in self.unnumbered.clone().into_iter().rev() {
            let rank = all[k as usize].verb.rank();
            highest = if self.numbered & bit(k) != 0 { highest.max(rank) } else { highest };
            if rank <= highest {
                self.unnumbered.retain(|other| *other != k);
                self.down &= if self.numbered & bit(k) != 0 { !0 } else { !bit(k) };
            }
        }
        self.obey(all);
    }

    /// Receive order `k` from its station; returns whether a hold took a landing back, which must not be.
    pub fn take(&mut self, k: u8, all: &[Order], bug: Bug) -> bool {
        let rank = all[k as usize].verb.rank();
        let was = self.holds.map_or(-1, |held| all[held as usize].verb.rank());
        if bug == "the newest stamp holds" {
            if self.holds.is_none_or(|held| k > held) {
                self.down |= if rank > 0 { bit(k) } else { 0 };
                (self.holds, self.numbered) = (Some(k), self.numbered | bit(k));
            }
            return false;
        }
        if rank == 0 || self.received(k) {
            return false;
        }
        self.unnumbered.push(k);
        self.down |= bit(k);
        self.obey(all);
        if bug == "a hold takes a landing back" {
            self.holds = Some(k);
        }
        was == 2 && self.holds.is_some_and(|held| all[held as usize].verb == Verb::Hold)
    }

    fn obey(&mut self, all: &[Order]) {
        let rank = |held: Option<u8>| held.map_or(-1, |k| all[k as usize].verb.rank());
        self.holds = self.logged;
        for k in &self.unnumbered {
            if rank(Some(*k)) >= rank(self.holds) {
                self.holds = Some(*k);
            }
        }
        self.down |= if rank(self.holds) > 0 { self.holds.map_or(0, bit) } else { 0 };
    }
}
