//! Which order holds: pilot/orders.py. Versions are bits: of order k the bit k, of "came down by order k" the bit MOST + k.

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

/// `rightful` is not part of the protocol: the holds and landings that its giver may end, for they came before it asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Order {
    pub verb: Verb,
    pub giver: u8,
    pub knows: u16,
    pub rightful: u8,
}

pub fn bit(order: u8) -> u16 {
    1 << order
}

pub const ANY_CAME_DOWN: u16 = !0 << MOST;

pub fn came_down(order: u8) -> u16 {
    1 << (MOST as u8 + order)
}

/// The orders that one pilot has taken in. `down` is not part of the protocol: the holds and landings among them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Orders {
    pub holds: Option<u8>,
    pub concurrent: u16,
    past: u16,
    pub down: u8,
}

impl Orders {
    pub fn newest(&self) -> u16 {
        self.concurrent | self.holds.map_or(0, bit)
    }

    pub fn spent(&self) -> bool {
        self.holds.is_some_and(|held| self.concurrent & came_down(held) != 0)
    }

    pub fn knows_of(&self, order: u8) -> bool {
        self.past & bit(order) != 0
    }

    /// Take in order `k`; returns whether a hold took a landing back, which must not be.
    pub fn take(&mut self, k: u8, all: &[Order], bug: Bug) -> bool {
        let order = all[k as usize];
        let rank = order.verb.rank();
        let was = self.holds.map_or(-1, |held| all[held as usize].verb.rank());
        if bug == "the newest stamp holds" {
            if self.holds.is_none_or(|held| k > held) {
                self.down |= if rank > 0 { bit(k) as u8 } else { 0 };
                self.holds = Some(k);
            }
            self.past |= bit(k);
            return false;
        }
        if self.knows_of(k) {
            return false;
        }
        let unknown = self.newest() & !order.knows;
        if rank == 0 && unknown != 0 && bug != "orders name nothing" {
            return false;
        }
        self.past |= bit(k) | if rank == 0 { order.knows & 0xff } else { 0 };
        self.down |= if rank > 0 { bit(k) as u8 } else { 0 };
        if 0 < rank && rank < was && bug != "a hold takes a landing back" {
            self.concurrent = self.concurrent & !order.knows | bit(k);
            return false;
        }
        self.concurrent = unknown;
        self.holds = Some(k);
        rank == 1 && was == 2
    }

    pub fn ended(&mut self, all: &[Order]) {
        if let Some(held) = self.holds {
            if all[held as usize].verb != Verb::Land {
                self.concurrent |= came_down(held);
            }
        }
    }
}
