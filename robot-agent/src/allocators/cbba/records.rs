//! What ACBBA knows of one place of one task: of each robot the newest word about its bid, whoever passed it on.
//!
//! The paper keeps of each task the winner alone, with the time of its bid (Johnson, Ponda, Choi, How, AIAA 2010), and its table judges
//! claims of two robots by their times. But which of two claims of different robots is newer says nothing of whether either still
//! holds: where not all hear each other, a bid that its robot has long taken back can be passed on for ever. Here times are only ever
//! compared between words about the same robot, and only bids between robots. So whoever knows the same words believes the same, in
//! whichever order they came.

use alliance_proto::allocation::consensus::Claim;
use alliance_proto::ids::RobotId;
use alliance_proto::time::SimTime;

/// The newest word about one robot's bid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Record {
    /// Whose, and how much; 0 if it has taken its bid back.
    pub claim: Claim,
    /// When the bid was made, or taken back.
    pub made: SimTime,
    /// Whether the team has to be told.
    pub is_unsaid: bool,
}

impl Record {
    fn is_newer_than(&self, other: &Self) -> bool {
        // One robot makes at most one bid a step; only forged words or a bid of a robot that begins anew can be of the same time.
        let key = |it: &Self| (it.made, it.claim.value);
        key(self) > key(other)
    }
}

/// The newest words about all robots that ever bid for the place in this round, by rank.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Records(Vec<Record>);

impl Records {
    fn find(&self, robot: RobotId) -> Result<usize, usize> {
        self.0
            .binary_search_by_key(&robot, |record| record.claim.robot)
    }

    /// What is known of a robot; `None` if it never bid.
    pub fn of(&self, robot: RobotId) -> Option<&Record> {
        self.find(robot).ok().map(|at| &self.0[at])
    }

    /// All of them.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut Record> {
        self.0.iter_mut()
    }

    /// A word about a robot's bid. If it is news it is kept and has to be passed on; if something newer is known, that has to be told.
    /// Whether it was news.
    pub fn hear(&mut self, claim: Claim, made: SimTime) -> bool {
        let word = Record {
            claim,
            made,
            is_unsaid: true,
        };
        match self.find(claim.robot) {
            Err(at) => self.0.insert(at, word),
            Ok(at) => {
                let known = &mut self.0[at];
                if !word.is_newer_than(known) {
                    known.is_unsaid |= known.is_newer_than(&word);
                    return false;
                }
                *known = word;
            }
        }
        true
    }

    /// What the robot itself knows best: its own bid.
    pub fn set(&mut self, claim: Claim, made: SimTime) {
        let record = Record {
            claim,
            made,
            is_unsaid: true,
        };
        match self.find(claim.robot) {
            Err(at) => self.0.insert(at, record),
            Ok(at) => self.0[at] = record,
        }
    }

    /// What is known of a robot has to be told once more.
    pub fn tell(&mut self, robot: RobotId) {
        if let Ok(at) = self.find(robot) {
            self.0[at].is_unsaid = true;
        }
    }

    /// The largest bid but for that of `me`.
    pub fn best_but(&self, me: RobotId) -> Option<Claim> {
        let claims = self.0.iter().map(|record| record.claim);
        let others = claims.filter(|claim| claim.robot != me && claim.value > 0.0);
        others.reduce(|best, claim| if claim.beats(&best) { claim } else { best })
    }

    /// A newer round voids all of it.
    pub fn clear(&mut self) {
        self.0.clear();
    }
}
