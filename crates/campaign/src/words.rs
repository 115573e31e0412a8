//! The words by which columns go, in English, German, French, and the commonest in Spanish, Portuguese and Italian.

/// Words of a channel: those that name it, and those that only fit it.
pub(crate) struct Words {
    pub channel: &'static str,
    strong: &'static [&'static str],
    weak: &'static [&'static str],
}

/// The channels in the order in which columns are given to them.
pub(crate) const CHANNELS: [Words; 7] = [
    Words {
        channel: "time",
        strong: &[
            "time",
            "zeit",
            "temps",
            "zeitstempel",
            "timestamp",
            "horodatage",
            "uhrzeit",
            "elapsed",
            "abszeit",
            "tiempo",
            "tempo",
        ],
        weak: &["t", "s", "sec", "datum", "date", "sekunden", "ms"],
    },
    Words {
        channel: "position",
        strong: &[
            "position",
            "weg",
            "hub",
            "lvdt",
            "stroke",
            "travel",
            "stellung",
            "course",
            "deplacement",
            "displacement",
            "lage",
            "stem",
            "spindel",
            "stellweg",
            "hubweg",
            "tige",
            "encoder",
            "posicion",
            "posicao",
            "posizione",
            "desplazamiento",
            "deslocamento",
            "carrera",
            "corsa",
            "opening",
            "oeffnung",
            "ouverture",
            "apertura",
        ],
        weak: &["desl", "pos", "x", "s", "z", "sensor", "capteur", "geber"],
    },
    Words {
        channel: "supply_pressure",
        strong: &[
            "supply",
            "versorgung",
            "netz",
            "netzdruck",
            "zuluft",
            "speise",
            "speisedruck",
            "vordruck",
            "versorgungsdruck",
            "alimentation",
            "reseau",
            "manifold",
            "inlet",
            "air",
            "vorlauf",
            "alimentacion",
            "alimentacao",
            "alimentazione",
        ],
        weak: &["pv", "ps", "p0", "tank", "eingang", "kessel"],
    },
    Words {
        channel: "chamber_pressure",
        strong: &[
            "chamber",
            "kammer",
            "kammerdruck",
            "cylinder",
            "cyl",
            "zylinder",
            "zyl",
            "zylinderdruck",
            "chambre",
            "verin",
            "antrieb",
            "antriebsdruck",
            "actuator",
            "membran",
            "diaphragm",
            "kolben",
            "piston",
            "camara",
            "cilindro",
            "camera",
        ],
        weak: &["pc", "pk", "p1", "pa"],
    },
    Words {
        channel: "pipe_pressure",
        strong: &[
            "pipe",
            "leitung",
            "leitungsdruck",
            "line",
            "conduite",
            "tuyau",
            "rohr",
            "schlauch",
            "hose",
            "tubing",
            "steuerdruck",
            "pilot",
        ],
        weak: &["pl", "pp", "p2"],
    },
    Words {
        channel: "command",
        strong: &[
            "command",
            "cmd",
            "befehl",
            "ansteuerung",
            "steuersignal",
            "sollwert",
            "magnetventil",
            "solenoid",
            "spule",
            "coil",
            "commande",
            "consigne",
            "bobine",
            "electrovanne",
            "setpoint",
            "stellsignal",
            "schaltsignal",
            "spulenspannung",
        ],
        weak: &[
            "ventil",
            "valve",
            "vanne",
            "y1",
            "y",
            "di",
            "do",
            "digital",
            "out",
            "signal",
            "trigger",
            "u",
            "steuerung",
        ],
    },
    Words { channel: "temperature", strong: &["temperature", "temperatur", "temp"], weak: &["tamb", "tu"] },
];

/// Words of columns that hold 0 and 1 and are no command.
const SWITCHES: [&str; 9] = ["endlage", "endschalter", "limit", "switch", "fin", "zs", "zso", "zsc", "rueckmeldung"];

/// Words that end like one of the above and mean something else.
const NO_COMPOUNDS: [&str; 8] =
    ["system", "subsystem", "filesystem", "baseline", "offline", "online", "deadline", "anlage"];

/// The parts of a name in small letters, umlauts and accents written out.
pub(crate) fn parts(name: &str) -> Vec<String> {
    let plain = column_source::written_out(name);
    let parts = plain.split(|character: char| !character.is_alphanumeric());
    parts.filter(|part| !part.is_empty()).map(str::to_owned).collect()
}

/// How well a name fits a channel: 2 for a word that names it, 1 for one that fits, 0 for none.
pub(crate) fn fit(name: &str, words: &Words) -> u32 {
    let parts = parts(name);
    // German words run together: "Kolbenweg", "Stellhub".
    let compounds = || parts.iter().filter(|part| !NO_COMPOUNDS.contains(&part.as_str()));
    let names = |word: &&str| {
        compounds().any(|part| part == word || word.len() > 3 && (part.starts_with(*word) || part.ends_with(*word)))
            || word.len() == 3 && compounds().any(|part| part.len() > 5 && part.ends_with(*word))
    };
    if words.strong.iter().any(names) {
        2
    } else {
        u32::from(words.weak.iter().any(|word| parts.iter().any(|part| part == word)))
    }
}

/// Whether a name is that of a time.
pub(crate) fn is_time(name: &str) -> bool {
    CHANNELS.iter().any(|words| words.channel == "time" && fit(name, words) == 2)
}

/// Whether a name is that of a limit switch.
pub(crate) fn is_switch(name: &str) -> bool {
    parts(name).iter().any(|part| SWITCHES.iter().any(|word| part.starts_with(word)))
}

/// Whether a command's name says what its 1 means: `Some(true)` for close.
pub(crate) fn says_closes(name: &str) -> Option<bool> {
    let parts = parts(name);
    let has = |words: &[&str]| parts.iter().any(|part| words.contains(&part.as_str()));
    let close =
        has(&["close", "closing", "zu", "schliessen", "fermer", "fermeture", "energised", "energized", "bestromt"]);
    let open = has(&["open", "opening", "auf", "oeffnen", "ouvrir", "ouverture"]);
    (close != open).then_some(close)
}
