//! The kinds of items that a person places in the room.

/// A kind of items, and its tables in a scenario file.
#[derive(Debug)]
pub struct ItemKind {
    /// The name for people and in requests.
    pub name: &'static str,
    /// The keys of the list, or of the single table.
    pub path: &'static [&'static str],
    /// False for a single table.
    pub is_list: bool,
    pub place: Place,
    /// The keys of further numbers that the editor shows.
    pub numbers: &'static [&'static str],
    pub outline: OutlineKind,
    pub fresh: Fresh,
    /// The meaning of a list without entries: true if the scenario then has its default entries, or none is allowed.
    pub needs_one: bool,
}

/// The keys of an item's place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// `x_m`, `y_m` and `heading_deg` in the table `start`.
    Start,
    /// `x_m` and `y_m`.
    Meters,
    /// `x_fraction` and `y_fraction` of the room.
    Fractions,
}

/// The outline of an item in the room.
#[derive(Clone, Copy, Debug)]
pub enum OutlineKind {
    /// The bodies of the robots of a block.
    Bodies,
    /// `width_m` and `height_m` from the lower left corner.
    Rectangle,
    /// A disc, whose radius is at this place of the scenario in JSON.
    Disc(&'static str),
    /// A bar parallel to y.
    Bar,
}

/// The contents of a new item besides its place.
#[derive(Clone, Copy, Debug)]
pub enum Fresh {
    /// Those of the last item of the list, with a name that begins with this text. `None`: without a name.
    Copy(Option<&'static str>),
    /// A name that begins with the text, if any, and numbers.
    Numbers(Option<&'static str>, &'static [(&'static str, f64)]),
    /// The key `kind`, with one of the names in this list of the scenario in JSON.
    Kinds(&'static str),
    /// Items of this kind cannot be added.
    Never,
}

/// The keys of a place in requests.
pub const X: &str = "x_m";
pub const Y: &str = "y_m";

/// All kinds, from the floor up: a click selects the last item below the pointer.
pub const KINDS: &[ItemKind] = &[
    ItemKind {
        name: "deposit",
        path: &["waste", "deposit"],
        is_list: false,
        place: Place::Fractions,
        numbers: &["radius_m"],
        outline: OutlineKind::Disc("/waste/deposit/radius_m"),
        fresh: Fresh::Never,
        needs_one: true,
    },
    ItemKind {
        name: "further deposit",
        path: &["waste", "further_deposits"],
        is_list: true,
        place: Place::Fractions,
        numbers: &[],
        outline: OutlineKind::Disc("/waste/deposit/radius_m"),
        fresh: Fresh::Numbers(None, &[]),
        needs_one: false,
    },
    ItemKind {
        name: "spill",
        path: &["waste", "spills"],
        is_list: true,
        place: Place::Fractions,
        numbers: &["items"],
        outline: OutlineKind::Disc("/waste/spill_radius_m"),
        fresh: Fresh::Numbers(Some("spill"), &[("items", 12.0)]),
        needs_one: true,
    },
    ItemKind {
        name: "zone",
        path: &["zones"],
        is_list: true,
        place: Place::Meters,
        numbers: &["width_m", "height_m", "speed_factor"],
        outline: OutlineKind::Rectangle,
        fresh: Fresh::Numbers(
            None,
            &[("width_m", 1.0), ("height_m", 1.0), ("speed_factor", 0.5)],
        ),
        needs_one: false,
    },
    ItemKind {
        name: "obstacle",
        path: &["obstacles"],
        is_list: true,
        place: Place::Meters,
        numbers: &["width_m", "height_m", "penetrability"],
        outline: OutlineKind::Rectangle,
        fresh: Fresh::Numbers(None, &[("width_m", 1.0), ("height_m", 1.0)]),
        needs_one: false,
    },
    ItemKind {
        name: "point",
        path: &["service", "points"],
        is_list: true,
        place: Place::Meters,
        numbers: &["arrival_s"],
        outline: OutlineKind::Disc("/service/reach_m"),
        fresh: Fresh::Kinds("/service/kinds"),
        needs_one: false,
    },
    ItemKind {
        name: "charger",
        path: &["service", "chargers"],
        is_list: true,
        place: Place::Meters,
        numbers: &["rate_w"],
        outline: OutlineKind::Disc("/service/reach_m"),
        fresh: Fresh::Numbers(None, &[("rate_w", 100.0)]),
        needs_one: false,
    },
    ItemKind {
        name: "bar",
        path: &["push", "bars"],
        is_list: true,
        place: Place::Meters,
        numbers: &["goal_x_m"],
        outline: OutlineKind::Bar,
        fresh: Fresh::Copy(None),
        needs_one: true,
    },
    ItemKind {
        name: "robot",
        path: &["robots"],
        is_list: true,
        place: Place::Start,
        numbers: &["heading_deg"],
        outline: OutlineKind::Bodies,
        fresh: Fresh::Copy(Some("r")),
        needs_one: true,
    },
];

impl ItemKind {
    /// Returns the kind with this name.
    #[must_use]
    pub fn find(name: &str) -> Option<&'static Self> {
        KINDS.iter().find(|kind| kind.name == name)
    }

    /// Returns the place of the list or table in the scenario as JSON.
    #[must_use]
    pub fn pointer(&self) -> String {
        self.path.iter().map(|key| format!("/{key}")).collect()
    }
}
