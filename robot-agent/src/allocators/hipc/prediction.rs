//! The plan of a robot for itself and its teammates: the sequential greedy assignment with warped bids, from the claims
//! that are known. CBBA ends with the same assignment (Choi, Brunet, How 2009).

use proto::allocation::awareness::TaskCost;
use proto::allocation::consensus::WinningBid;
use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;

use crate::allocator::{Choice, Input};
use crate::allocators::cbba::bundle::Bundle;
use crate::allocators::cbba::score::{Offer, Scores, bid};
use crate::allocators::consensus::winners::{OwnTask, Winners};

/// Returns the robot's first choice for each of its tasks, by the index in [`Winners::tasks`].
pub fn choices_by_task<'a>(input: &Input<'a>, beliefs: &Winners) -> Vec<Option<&'a Choice>> {
    let mut first = vec![None; beliefs.tasks().len()];
    for choice in input.choices {
        let tasks = beliefs.tasks();
        if let Ok(own) = tasks.binary_search_by_key(&choice.task, |own| own.task) {
            first[own].get_or_insert(choice);
        }
    }
    first
}

/// One robot of the plan.
#[derive(Clone, Debug)]
pub struct Planner {
    robot: RobotId,
    offers: Vec<Option<Offer>>,
    /// The path and the bids in the order of choice, as indices in [`Winners::tasks`].
    path: Vec<usize>,
    bids: Vec<(usize, f32)>,
    /// The index in the path and the bid of each further task, by its index; `None` if the path has changed since.
    further: Option<Vec<Option<(usize, f32)>>>,
    /// True if the path of a teammate must be computed from its bids.
    is_teammate: bool,
}

/// The best bid of one planner.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bid {
    priority: i32,
    value: f32,
    own: usize,
    /// The index in the path.
    at: usize,
    /// The index of the entry; `None` for a task without negotiation.
    place: Option<usize>,
}

impl Planner {
    pub fn of_self(robot: RobotId, offers: Vec<Option<Offer>>, bundle: &Bundle) -> Self {
        let (path, bids) = bundle.plan();
        Self {
            robot,
            offers,
            path: path.to_vec(),
            bids: bids.collect(),
            further: None,
            is_teammate: false,
        }
    }

    /// Creates a planner with the tasks that the teammate has claimed, in the order of its bids. Reward and window are
    /// those of the robot's own choices, by the index of the task.
    pub fn of_teammate(
        robot: RobotId,
        costs: &[Option<TaskCost>],
        choices: &[Option<&Choice>],
        beliefs: &Winners,
    ) -> Self {
        let offer = |(cost, choice): (&Option<TaskCost>, &Option<&Choice>)| {
            let (cost, choice) = (cost.as_ref()?, (*choice)?);
            Some(Offer {
                behavior: choice.behavior,
                reward: choice.reward,
                cost_s: cost.cost_s,
                opens_in_s: choice.opens_in_s,
                worth: cost.worth,
            })
        };
        let offers = costs.iter().zip(choices).map(offer);
        let mut bids: Vec<(usize, f32)> = Vec::new();
        for entry in beliefs.entries() {
            let tasks = beliefs.tasks();
            let own = tasks.binary_search_by_key(&entry.task, |own| own.task);
            if let (Some(claim), Ok(own)) = (entry.claim, own)
                && claim.robot == robot
            {
                bids.push((own, claim.value));
            }
        }
        let priority = |own: usize| beliefs.tasks()[own].priority;
        bids.sort_by(|a, b| {
            let by_value = b.1.total_cmp(&a.1).then(a.0.cmp(&b.0));
            priority(b.0).cmp(&priority(a.0)).then(by_value)
        });
        Self {
            robot,
            offers: offers.collect(),
            path: Vec::new(),
            bids,
            further: None,
            is_teammate: true,
        }
    }

    /// Inserts the claimed tasks into the path, each where it adds most.
    fn follow_claims(&mut self, scores: &Scores<'_>) {
        for &(own, _) in &self.bids {
            let before = scores.score(&self.path);
            let best = before.and_then(|before| scores.insertion(&self.path, own, 0, before));
            let at = best.map_or(self.path.len(), |(at, _)| at);
            self.path.insert(at, own);
        }
    }

    /// Returns the best bid that wins against the planned claims.
    fn best(&mut self, most: usize, plan: &Plan<'_>) -> Option<Bid> {
        if self.bids.len() >= most {
            return None;
        }
        let further = match self.further.take() {
            Some(further) => further,
            None => self.further_bids(plan)?,
        };
        let mut best: Option<Bid> = None;
        for (own, further) in further.iter().enumerate() {
            let Some((at, value)) = *further else {
                continue;
            };
            let Some(place) = plan.place_won(own, self.robot, value) else {
                continue;
            };
            let candidate = Bid {
                priority: plan.beliefs.tasks()[own].priority,
                value,
                own,
                at,
                place,
            };
            let key = |bid: &Bid| (bid.priority, bid.value);
            if best.is_none_or(|best| key(&candidate) > key(&best)) {
                best = Some(candidate);
            }
        }
        self.further = Some(further);
        best
    }

    /// Computes the best index in the path and the bid of each task that is not in the path.
    fn further_bids(&self, plan: &Plan<'_>) -> Option<Vec<Option<(usize, f32)>>> {
        let scores = plan.scores(&self.offers);
        let before = scores.score(&self.path)?;
        let tasks = plan.beliefs.tasks();
        let further = |(own, task): (usize, &OwnTask)| {
            if self.offers[own].is_none() || self.path.contains(&own) {
                return None;
            }
            let (at, gain) = scores.insertion(&self.path, own, 0, before)?;
            let bids = self.bids.iter();
            let equal = bids.filter(|(other, _)| tasks[*other].priority == task.priority);
            Some((at, equal.fold(bid(gain), |least, other| least.min(other.1))))
        };
        Some(tasks.iter().enumerate().map(further).collect())
    }

    /// Adds a task to the path.
    fn take(&mut self, bid: &Bid) {
        self.path.insert(bid.at, bid.own);
        self.bids.push((bid.own, bid.value));
        self.further = None;
    }

    /// Removes a task that another robot has taken in the plan, and all later choices. Returns their indices.
    fn lose(&mut self, own: usize) -> Vec<usize> {
        let from = self.bids.iter().position(|bid| bid.0 == own);
        let lost = self.bids.drain(from.unwrap_or(self.bids.len())..);
        let lost: Vec<usize> = lost.map(|bid| bid.0).collect();
        self.path.retain(|own| !lost.contains(own));
        self.further = None;
        lost
    }
}

/// The planned claims, by the index of the entry.
struct Plan<'a> {
    beliefs: &'a Winners,
    seconds: &'a dyn Fn(&[TaskId], TaskId) -> Option<f64>,
    claims: Vec<Option<WinningBid>>,
}

impl Plan<'_> {
    fn scores<'a>(&'a self, offers: &'a [Option<Offer>]) -> Scores<'a> {
        Scores {
            offers,
            tasks: self.beliefs.tasks(),
            seconds: self.seconds,
        }
    }

    /// Returns the place that a bid wins, the one with the lowest claim. The inner value is `None` for a task without
    /// negotiation.
    fn place_won(&self, own: usize, robot: RobotId, value: f32) -> Option<Option<usize>> {
        let places = self.beliefs.places_of(&self.beliefs.tasks()[own]);
        if places.is_empty() {
            return Some(None);
        }
        let worst =
            places.reduce(
                |worst, place| match (self.claims[worst], self.claims[place]) {
                    (Some(worse), Some(claim)) if worse.beats(&claim) => place,
                    (Some(_), None) => place,
                    _ => worst,
                },
            )?;
        let bid = WinningBid { robot, value };
        let is_won = self.claims[worst].is_none_or(|claim| bid.beats(&claim));
        is_won.then_some(Some(worst))
    }
}

/// Plans for a team, the robot itself first. Returns for each of its tasks whether the robot leaves it: other robots
/// claim all its places, at least one of them only in the plan, and the robot does not do it in the plan.
pub fn predict(
    mut team: Vec<Planner>,
    most: usize,
    beliefs: &Winners,
    seconds: &dyn Fn(&[TaskId], TaskId) -> Option<f64>,
) -> Vec<bool> {
    let mut plan = Plan {
        beliefs,
        seconds,
        claims: beliefs.entries().iter().map(|entry| entry.claim).collect(),
    };
    for planner in &mut team {
        if planner.is_teammate {
            let offers = planner.offers.clone();
            planner.follow_claims(&plan.scores(&offers));
        }
    }
    let mut best: Vec<Option<Bid>> = team.iter_mut().map(|one| one.best(most, &plan)).collect();
    // Each turn gives a task to a robot. Takes from each other, which are rare, must not go on without end.
    for _ in 0..2 * most * team.len() {
        let mut next: Option<(usize, Bid)> = None;
        for (at, bid) in best.iter().enumerate() {
            let Some(bid) = bid else { continue };
            let goes_first = |(other, than): (usize, Bid)| {
                let by_rank = team[at].robot < team[other].robot;
                let (key, than) = ((bid.priority, bid.value), (than.priority, than.value));
                key > than || (key == than && by_rank)
            };
            if next.is_none_or(goes_first) {
                next = Some((at, *bid));
            }
        }
        let Some((winner, bid)) = next else { break };
        let mut freed = false;
        if let Some(place) = bid.place {
            let robot = team[winner].robot;
            let claim = WinningBid {
                robot,
                value: bid.value,
            };
            let former = plan.claims[place].replace(claim);
            let loser =
                former.and_then(|former| team.iter().position(|one| one.robot == former.robot));
            if let Some(loser) = loser {
                let lost = team[loser].lose(bid.own);
                for place in lost
                    .into_iter()
                    .flat_map(|own| beliefs.places_of(&beliefs.tasks()[own]))
                {
                    if plan.claims[place].is_some_and(|claim| claim.robot == team[loser].robot) {
                        plan.claims[place] = None;
                    }
                }
                freed = true;
            }
        }
        team[winner].take(&bid);
        for at in 0..team.len() {
            let is_affected =
                freed || at == winner || best[at].is_some_and(|other| other.own == bid.own);
            if is_affected {
                best[at] = team[at].best(most, &plan);
            }
        }
    }
    let is_left = |(own, task): (usize, _)| {
        let mut places = beliefs.places_of(task);
        let is_new = |place: usize| plan.claims[place] != beliefs.entries()[place].claim;
        !team[0].path.contains(&own)
            && places.clone().any(is_new)
            && places.all(|place| plan.claims[place].is_some())
    };
    beliefs.tasks().iter().enumerate().map(is_left).collect()
}

/// The tasks that the robot leaves to teammates, and since when. A prediction can be wrong: a task is left for a limited
/// time only, which begins anew with each new claim.
#[derive(Clone, Debug)]
pub struct LeftTasks {
    /// The time since which each task is left without a new claim, by its index in [`Winners::tasks`].
    since: Vec<Option<SimTime>>,
    /// The tasks that are left at the last choice.
    left: Vec<bool>,
    /// The claims at the last choice, by the index of the entry.
    claims: Vec<Option<WinningBid>>,
}

impl LeftTasks {
    pub fn new(beliefs: &Winners) -> Self {
        Self {
            since: vec![None; beliefs.tasks().len()],
            left: Vec::new(),
            claims: vec![None; beliefs.entries().len()],
        }
    }

    /// Returns whether the robot has waited long enough for a task that it still leaves.
    pub fn has_waited(&self, now: SimTime, wait: SimTime) -> bool {
        let mut left = self.left.iter().zip(&self.since);
        left.any(|(&left, since)| left && since.is_some_and(|since| now.since(since) >= wait))
    }

    /// Records which tasks a plan leaves, and returns those for which the robot has not waited long enough.
    pub fn leave(
        &mut self,
        planned: &[bool],
        beliefs: &Winners,
        now: SimTime,
        wait: SimTime,
    ) -> &[bool] {
        self.left.clear();
        for (own, &is_planned) in planned.iter().enumerate() {
            let since = &mut self.since[own];
            let mut places = beliefs.places_of(&beliefs.tasks()[own]);
            // A new claim ends the wait. The next one begins when the task is left again.
            if places.any(|place| beliefs.entries()[place].claim != self.claims[place]) {
                *since = None;
            }
            if is_planned && since.is_none() {
                *since = Some(now);
            }
            let has_waited = since.is_some_and(|since| now.since(since) >= wait);
            self.left.push(is_planned && !has_waited);
        }
        self.claims.clear();
        let entries = beliefs.entries().iter();
        self.claims.extend(entries.map(|entry| entry.claim));
        &self.left
    }
}
