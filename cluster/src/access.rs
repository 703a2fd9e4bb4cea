//! The access control of a run's routers, in zenoh's configuration format. Everything that is not allowed is denied,
//! and the router drops denied messages without an error.
//!
//! Each link belongs to one user, identified by a name and a password, and on TLS links also by the name in the
//! certificate.

use serde_json::{Value, json};

use proto::identity;
use proto::keys::{ALIVE_WORLDS, KeyExpressions};

/// The robots behind one link.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LinkMembers {
    /// The identity of the link.
    pub identity: String,
    /// The name of the host, if the link belongs to one.
    pub host: Option<String>,
    pub robots: Vec<String>,
}

impl LinkMembers {
    #[must_use]
    pub fn robot(name: &str) -> Self {
        Self {
            identity: identity::robot(name),
            host: None,
            robots: vec![name.to_owned()],
        }
    }

    #[must_use]
    pub fn host(name: &str, robots: Vec<String>) -> Self {
        Self {
            identity: identity::host(name),
            host: Some(name.to_owned()),
            robots,
        }
    }
}

/// The name of TLS links in zenoh.
const TLS: &str = "tls";

/// The names of links without certificates.
const UNCERTIFIED: [&str; 2] = ["unixsock-stream", "tcp"];

/// Returns the access control of the gateway. Its clients receive everything and send queries on the control topic.
#[must_use]
pub fn gateway_rules(keys: &KeyExpressions) -> String {
    let receive = [
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
    rules.allow("anybody", "ingress", &receive, vec![keys.all()]);
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

/// Returns the access control of the router of a network run. The user `trusted`, a process on the router's machine,
/// may do everything. So may the peer of an outgoing connection by the protocol `uplink`.
#[must_use]
pub fn team_rules(
    keys: &KeyExpressions,
    speakers: &[LinkMembers],
    trusted: &str,
    uplink: Option<&str>,
) -> String {
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
            subject["cert_common_names"] = json!([identity::WORLD]);
        }
        rules.add_subject("trusted", "uplink", subject);
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
    fn allow(&mut self, group: &str, flow: &str, messages: &[&str], keys: Vec<String>) {
        if keys.is_empty() {
            return;
        }
        self.rules.push(json!({
            "id": format!("{group}-{}", self.rules.len()),
            "permission": "allow", "flows": [flow], "messages": messages, "key_exprs": keys,
        }));
    }

    /// Applies the complete rules of a group to a subject.
    fn subject(&mut self, group: &str, subject: Value) {
        self.add_subject(group, group, subject);
    }

    /// Applies the rules of a group to another subject.
    fn add_subject(&mut self, group: &str, id: &str, mut subject: Value) {
        subject["id"] = json!(id);
        self.subjects.push(subject);
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

    fn speaker(&mut self, keys: &KeyExpressions, speaker: &LinkMembers) {
        let id = speaker.identity.as_str();
        let of_each = |key: &dyn Fn(&str) -> String| -> Vec<String> {
            speaker.robots.iter().map(|robot| key(robot)).collect()
        };
        let of_host = |key: &dyn Fn(&str) -> String| -> Vec<String> {
            speaker.host.iter().map(|host| key(host)).collect()
        };
        let ticks = of_each(&|robot| keys.tick(robot));
        let queries = [
            of_each(&|robot| keys.join(robot)),
            of_host(&|host| keys.enlist(host)),
        ]
        .concat();
        let process = of_host(&|host| keys.process(host));
        let sent = [
            of_each(&|robot| keys.report(robot)),
            of_each(&|robot| keys.team(robot, "*")),
            process.clone(),
        ]
        .concat();
        let alive = of_each(&|robot| keys.alive_of(robot));
        let watch = ["declare_liveliness_subscriber", "liveliness_query"];
        self.allow(id, "ingress", &["put"], sent);
        self.allow(id, "ingress", &["query"], queries.clone());
        self.allow(id, "egress", &["reply"], queries);
        self.allow(id, "ingress", &["declare_subscriber"], ticks.clone());
        self.allow(id, "egress", &["put"], ticks);
        self.allow(id, "ingress", &["liveliness_token"], alive);
        self.allow(id, "ingress", &watch, vec![ALIVE_WORLDS.to_owned()]);
        self.allow(
            id,
            "egress",
            &["liveliness_token"],
            vec![keys.alive_world()],
        );
        // A client publishes only if it receives the declarations of the subscribers.
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
        self.add_subject(id, &format!("{id}-certified"), certified);
    }

    fn into_text(self) -> String {
        json!({
            "enabled": true, "default_permission": "deny",
            "rules": self.rules, "subjects": self.subjects, "policies": self.policies,
        })
        .to_string()
    }
}
