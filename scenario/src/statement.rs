//! The ALLIANCE parameters, and single statements about them. Scenario sections and parameter files share this form.

use super::alliance::{AllianceSection, BehaviorSection};
use super::error::{Place, Problem};
use super::limits::{self, NumberRange};
use super::path::KeyPath;

/// A parameter of a behavior set (ALLIANCE.md §1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Parameter {
    BroadcastRate,
    CeasedAfter,
    FastImpatience,
    SlowImpatience,
    WillingToAffect,
    BeforeYielding,
    BeforeGivingUp,
}

impl Parameter {
    pub const ALL: [Self; 7] = [
        Self::BroadcastRate,
        Self::CeasedAfter,
        Self::FastImpatience,
        Self::SlowImpatience,
        Self::WillingToAffect,
        Self::BeforeYielding,
        Self::BeforeGivingUp,
    ];

    pub fn key(self) -> &'static str {
        match self {
            Self::BroadcastRate => "broadcast_rate_hz",
            Self::CeasedAfter => "ceased_after_s",
            Self::FastImpatience => "fast_impatience",
            Self::SlowImpatience => "slow_impatience",
            Self::WillingToAffect => "willing_to_affect_s",
            Self::BeforeYielding => "before_yielding_s",
            Self::BeforeGivingUp => "before_giving_up_s",
        }
    }

    /// Returns the name in a parameter file (thesis Fig. 3.4).
    pub fn property(self) -> &'static str {
        match self {
            Self::BroadcastRate => "broadcastRate",
            Self::CeasedAfter => "timeAllowedTillCeased",
            Self::FastImpatience => "fastImpatience",
            Self::SlowImpatience => "slowImpatience",
            Self::WillingToAffect => "timeWillingToAffect",
            Self::BeforeYielding => "timeBeforeYielding",
            Self::BeforeGivingUp => "timeBeforeGivingUp",
        }
    }

    /// Returns the range of values (ALLIANCE.md §1).
    pub fn range(self) -> NumberRange {
        limits::positive(match self {
            Self::BroadcastRate => "Hz",
            Self::FastImpatience | Self::SlowImpatience => "motivation/s",
            Self::CeasedAfter
            | Self::WillingToAffect
            | Self::BeforeYielding
            | Self::BeforeGivingUp => "s",
        })
    }

    /// Returns true if there is one value for each teammate.
    pub fn is_per_teammate(self) -> bool {
        matches!(self, Self::SlowImpatience | Self::WillingToAffect)
    }
}

/// A value of a parameter for a robot, a set and a teammate; `None` means all of them.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Statement {
    pub robot: Option<String>,
    pub set: Option<String>,
    pub teammate: Option<String>,
    pub parameter: Parameter,
    pub value: f64,
    pub place: Place,
}

impl Statement {
    /// Creates a statement for all robots and sets.
    pub fn new(parameter: Parameter, teammate: Option<&str>, value: f64, at: KeyPath) -> Self {
        Self {
            robot: None,
            set: None,
            teammate: teammate.map(str::to_owned),
            parameter,
            value,
            place: at.into(),
        }
    }

    /// Rejects a value that is wrong regardless of the others.
    pub fn check(&self) -> Result<(), Problem> {
        check_at(&self.place, self.parameter.range(), self.value)
    }
}

/// The range of the threshold θ (ALLIANCE.md §1).
pub(super) const THRESHOLD: NumberRange = limits::positive("");

/// Rejects a number at a place outside a range.
pub(super) fn check_at(place: &Place, range: NumberRange, value: f64) -> Result<(), Problem> {
    let checked = range.check((), value);
    checked.map_err(|problem| Problem {
        place: place.clone(),
        ..problem
    })
}

/// Returns all statements of `[alliance]`, weakest first. The plain value of a section comes before its values for
/// named teammates.
pub(super) fn statements(section: &AllianceSection) -> Vec<Statement> {
    let mut all = Vec::new();
    let alliance = KeyPath::new(["alliance"]);
    let mut push =
        |robot: Option<&str>, set: Option<&str>, values: &BehaviorSection, at: &KeyPath| {
            all.extend(stated(values, at).into_iter().map(|statement| Statement {
                robot: robot.map(str::to_owned),
                set: set.map(str::to_owned),
                ..statement
            }));
        };
    push(None, None, &section.defaults, &alliance.key("defaults"));
    for (set, values) in &section.sets {
        push(None, Some(set), values, &alliance.key("sets").key(set));
    }
    for (robot, of_robot) in &section.robots {
        let at = alliance.key("robots").key(robot);
        push(Some(robot), None, &of_robot.defaults, &at.key("defaults"));
        for (set, values) in &of_robot.sets {
            push(Some(robot), Some(set), values, &at.key("sets").key(set));
        }
    }
    all
}

/// Returns the statements of one section, for all robots and sets.
fn stated(section: &BehaviorSection, at: &KeyPath) -> Vec<Statement> {
    let BehaviorSection {
        broadcast_rate_hz,
        ceased_after_s,
        fast_impatience,
        slow_impatience,
        slow_impatience_toward,
        willing_to_affect_s,
        willing_to_affect_toward_s,
        before_yielding_s,
        before_giving_up_s,
    } = section;
    let plain = [
        (Parameter::BroadcastRate, broadcast_rate_hz),
        (Parameter::CeasedAfter, ceased_after_s),
        (Parameter::FastImpatience, fast_impatience),
        (Parameter::SlowImpatience, slow_impatience),
        (Parameter::WillingToAffect, willing_to_affect_s),
        (Parameter::BeforeYielding, before_yielding_s),
        (Parameter::BeforeGivingUp, before_giving_up_s),
    ];
    let plain = plain.into_iter().filter_map(|(parameter, value)| {
        let at = at.key(parameter.key());
        Some(Statement::new(parameter, None, (*value)?, at))
    });
    let (slow, willing) = (slow_impatience_toward, willing_to_affect_toward_s);
    let toward = [
        (Parameter::SlowImpatience, "slow_impatience_toward", slow),
        (
            Parameter::WillingToAffect,
            "willing_to_affect_toward_s",
            willing,
        ),
    ];
    let toward = toward.into_iter().flat_map(|(parameter, key, values)| {
        values.iter().map(move |(teammate, value)| {
            let at = at.key(key).key(teammate);
            Statement::new(parameter, Some(teammate), *value, at)
        })
    });
    plain.chain(toward).collect()
}
