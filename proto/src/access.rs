//! Access control of a run's routers, for zenoh: who may put, ask, hear and declare what. Whatever is not allowed is denied, so that an
//! expression with wildcards opens nothing. A client sees no error of what is denied: it does not arrive.
//!
//! Each link is that of one user, by name and password and, where it is one of TLS, by the name in the certificate.

use serde_json::{Value, json};

use crate::keys::{ALIVE_WORLDS, Keys};
use crate::member;

/// Those that speak over one link: a robot that connects by itself, or a host with all of its robots.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Speaker {
    /// [Identity](crate::member) of the link.
    pub identity: String,
    /// The host's name, if it is one.
    pub host: Option<String>,
    /// Names of the robots.
    pub robots: Vec<String>,
}

impl Speaker {
    /// A robot that connects by itself.
    #[must_use]
    pub fn robot(name: &str) -> Self {
        Self {
            identity: member::robot(name),
            host: None,
            robots: vec![name.to_owned()],
        }
    }

    /// A host, for its robots.
    #[must_use]
    pub fn host(name: &str, robots: Vec<String>) -> Self {
        Self {
            identity: member::host(name),
            host: Some(name.to_owned()),
            robots,
        }
    }
}

/// Links of TLS, in words of zenoh.
const TLS: &str = "tls";

/// Links without certificates.
const UNCERTIFIED: [&str; 2] = ["unixsock-stream", "tcp"];

/// For those who order and watch, at the gateway: they hear everything, and ask on the control topic. What goes out has come from the team.
#[must_use]
pub fn of_operators(keys: &Keys) -> String {
    let hear = [
        "declare_subscriber",
        "declare_liveliness_subscriber",
        "liveliness_query",
    ];
    let out = [
        "put",
        "query",
        "declare_queryable",
        "reply",
        "liveliness_token",
    ];
    let mut rules = Rules::default();
    rules.allow("anybody", "ingress", &hear, vec![keys.all()]);
    rules.allow(
        "anybody",
        "ingress",
        &["put", "query"],
        vec![keys.control()],
    );
    rules.allow("anybody", "egress", &out, vec!["**".to_owned()]);
    rules.subject("anybody", json!({}));
    rules.into_text()
}

/// For the router of a run over a network. Whoever logs in as `trusted`, a process of the router's own machine, may do everything; so may
/// who is connected to by one of the `uplink` protocols.
#[must_use]
pub fn of_team(keys: &Keys, speakers: &[Speaker], trusted: &str, uplink: Option<&str>) -> String {
    let all = [
        "put",
        "delete",
        "query",
        "reply",
        "declare_subscriber",
        "declare_queryable",
        "liveliness_token",
        "liveliness_query",
        "declare_liveliness_subscriber",
    ];
    let mut rules = Rules::default();
    for flow in ["ingress", "egress"] {
        rules.allow("trusted", flow, &all, vec!["**".to_owned()]);
    }
    rules.subject("trusted", json!({ "usernames": [trusted] }));
    if let Some(protocol) = uplink {
        let mut subject = json!({ "link_protocols": [protocol] });
        if protocol == TLS {
            subject["cert_common_names"] = json!([member::WORLD]);
        }
        rules.also("trusted", "uplink", subject);
    }
    for speaker in speakers {
        rules.speaker(keys, speaker);
    }
    rules.into_text()
}

#[derive(Default)]
struct Rules {
    rules: Vec<Value>,
    subjects: Vec<Value>,
    policies: Vec<Value>,
}

impl Rules {
    /// A rule of that group.
    fn allow(&mut self, group: &str, flow: &str, messages: &[&str], keys: Vec<String>) {
        if keys.is_empty() {
            return;
        }
        self.rules.push(json!({
            "id": format!("{group}-{}", self.rules.len()),
            "permission": "allow", "flows": [flow], "messages": messages, "key_exprs": keys,
        }));
    }

    /// For whom the rules of a group are; they are there already.
    fn subject(&mut self, group: &str, who: Value) {
        self.also(group, group, who);
    }

    /// For whom else.
    fn also(&mut self, group: &str, id: &str, mut who: Value) {
        who["id"] = json!(id);
        self.subjects.push(who);
        let prefix = format!("{group}-");
        let of_group = |id: &&str| {
            id.strip_prefix(&prefix)
                .is_some_and(|number| number.parse::<usize>().is_ok())
        };
        let rules: Vec<&str> = self
            .rules
            .iter()
            .filter_map(|rule| rule["id"].as_str())
            .filter(of_group)
            .collect();
        self.policies
            .push(json!({ "rules": rules, "subjects": [id] }));
    }

    fn speaker(&mut self, keys: &Keys, speaker: &Speaker) {
        let id = speaker.identity.as_str();
        let of_each = |key: &dyn Fn(&str) -> String| -> Vec<String> {
            speaker.robots.iter().map(|robot| key(robot)).collect()
        };
        let of_host = |key: &dyn Fn(&str) -> String| -> Vec<String> {
            speaker.host.iter().map(|host| key(host)).collect()
        };
        let ticks = of_each(&|robot| keys.tick(robot));
        let asks = [
            of_each(&|robot| keys.join(robot)),
            of_host(&|host| keys.enlist(host)),
        ]
        .concat();
        let process = of_host(&|host| keys.process(host));
        let heard = [ticks, vec![keys.team_all()]].concat();
        let said = [
            of_each(&|robot| keys.report(robot)),
            of_each(&|robot| keys.team(robot, "*")),
            process.clone(),
        ]
        .concat();
        let alive = of_each(&|robot| keys.alive_of(robot));
        let watch = ["declare_liveliness_subscriber", "liveliness_query"];
        self.allow(id, "ingress", &["put"], said);
        self.allow(id, "ingress", &["query"], asks.clone());
        self.allow(id, "egress", &["reply"], asks);
        self.allow(id, "ingress", &["declare_subscriber"], heard.clone());
        self.allow(id, "egress", &["put"], heard);
        self.allow(id, "ingress", &["liveliness_token"], alive);
        self.allow(id, "ingress", &watch, vec![ALIVE_WORLDS.to_owned()]);
        self.allow(
            id,
            "egress",
            &["liveliness_token"],
            vec![keys.alive_world()],
        );
        // Without knowing who listens nobody puts anything.
        self.allow(
            id,
            "egress",
            &["declare_subscriber"],
            vec![keys.reports(), keys.team_all(), keys.processes()],
        );
        self.allow(
            id,
            "egress",
            &["declare_queryable"],
            vec![keys.joins(), keys.enlist("*")],
        );
        self.allow(
            id,
            "ingress",
            &["declare_queryable", "reply"],
            process.clone(),
        );
        self.allow(id, "egress", &["query"], process);
        self.subject(
            id,
            json!({ "usernames": [id], "link_protocols": UNCERTIFIED }),
        );
        let certified =
            json!({ "usernames": [id], "link_protocols": [TLS], "cert_common_names": [id] });
        self.also(id, &format!("{id}-certified"), certified);
    }

    fn into_text(self) -> String {
        json!({
            "enabled": true, "default_permission": "deny",
            "rules": self.rules, "subjects": self.subjects, "policies": self.policies,
        })
        .to_string()
    }
}
