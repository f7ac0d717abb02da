//! The place of a header stamp, by the schema of a message: its first field, followed down.

use std::collections::HashMap;

/// The deepest message within messages that is followed.
const DEEPEST: usize = 16;

/// The most bytes at the beginning of a message that a stamp needs.
pub const PREFIX: usize = 80;

/// Where the stamp of a message is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StampField {
    /// Seconds and nanoseconds at the beginning.
    Time,
    /// Microseconds at the beginning.
    Micros,
    /// In the first element of a sequence.
    FirstOfSequence,
    /// Seconds and nanoseconds in the first field of JSON.
    Json,
}

/// The first field of a message.
#[derive(Debug, PartialEq, Eq)]
struct Field<'a> {
    kind: &'a str,
    name: &'a str,
    is_sequence: bool,
}

/// What messages are called that begin with a header, in bags without schemas.
const WITH_HEADER: [&str; 34] = [
    "ackermann_msgs/AckermannDriveStamped",
    "control_msgs/JointTrajectoryControllerState",
    "diagnostic_msgs/DiagnosticArray",
    "geometry_msgs/AccelStamped",
    "geometry_msgs/PointStamped",
    "geometry_msgs/PoseArray",
    "geometry_msgs/PoseStamped",
    "geometry_msgs/PoseWithCovarianceStamped",
    "geometry_msgs/TransformStamped",
    "geometry_msgs/TwistStamped",
    "geometry_msgs/TwistWithCovarianceStamped",
    "geometry_msgs/Vector3Stamped",
    "geometry_msgs/WrenchStamped",
    "nav_msgs/GridCells",
    "nav_msgs/OccupancyGrid",
    "nav_msgs/Odometry",
    "nav_msgs/Path",
    "sensor_msgs/BatteryState",
    "sensor_msgs/CameraInfo",
    "sensor_msgs/CompressedImage",
    "sensor_msgs/FluidPressure",
    "sensor_msgs/Image",
    "sensor_msgs/Imu",
    "sensor_msgs/JointState",
    "sensor_msgs/Joy",
    "sensor_msgs/LaserScan",
    "sensor_msgs/MagneticField",
    "sensor_msgs/NavSatFix",
    "sensor_msgs/PointCloud2",
    "sensor_msgs/Range",
    "sensor_msgs/Temperature",
    "stereo_msgs/DisparityImage",
    "trajectory_msgs/JointTrajectory",
    "vision_msgs/Detection2DArray",
];

/// `name` without the folder in its middle: `std_msgs/msg/Header` is `std_msgs/Header`.
fn short(name: &str) -> String {
    name.replace("::", "/").replace("/msg/", "/")
}

/// Returns the place of the stamp in messages of the type `name`, by its schema.
pub fn stamp_field(name: &str, encoding: &str, schema: &[u8]) -> Option<StampField> {
    let name = short(name);
    let text = String::from_utf8_lossy(schema);
    if encoding == "jsonschema" {
        return Some(StampField::Json);
    }
    let fields = match encoding {
        "ros2msg" => message_fields(&name, &text),
        "ros2idl" => idl_fields(&text),
        _ => HashMap::new(),
    };
    if fields.is_empty() {
        return known(&name);
    }
    followed(&name, &fields)
}

/// Returns the place of the stamp in messages of the distribution.
fn known(name: &str) -> Option<StampField> {
    match name {
        "tf2_msgs/TFMessage" => Some(StampField::FirstOfSequence),
        "std_msgs/Header" | "builtin_interfaces/Time" | "rosgraph_msgs/TopicClock" => {
            Some(StampField::Time)
        }
        name => WITH_HEADER.contains(&name).then_some(StampField::Time),
    }
}

/// Follows the first fields down from the type `name`.
fn followed(name: &str, fields: &HashMap<String, Field<'_>>) -> Option<StampField> {
    let (mut at, mut in_sequence) = (name.to_owned(), false);
    for depth in 0..DEEPEST {
        let Some(field) = fields.get(&at) else {
            break;
        };
        if field.kind == "uint64" && field.name == "timestamp" && !field.is_sequence {
            return (!in_sequence).then_some(StampField::Micros);
        }
        if field.is_sequence && depth > 0 {
            return None;
        }
        in_sequence |= field.is_sequence;
        at = resolved(&at, field.kind);
        match at.as_str() {
            "std_msgs/Header" if in_sequence => return Some(StampField::FirstOfSequence),
            "std_msgs/Header" => return Some(StampField::Time),
            "builtin_interfaces/Time" => return (!in_sequence).then_some(StampField::Time),
            _ => {}
        }
    }
    None
}

/// Returns the full name of the type that a message of the type `within` calls `kind`.
fn resolved(within: &str, kind: &str) -> String {
    let kind = short(kind);
    match kind.as_str() {
        "Header" => "std_msgs/Header".to_owned(),
        "time" | "Time" => "builtin_interfaces/Time".to_owned(),
        _ if kind.contains('/') => kind,
        _ => {
            let package = within.split('/').next().unwrap_or_default();
            format!("{package}/{kind}")
        }
    }
}

/// Returns the first field of each message in a schema of `.msg` files; the first is the type
/// `name`.
fn message_fields<'a>(name: &str, text: &'a str) -> HashMap<String, Field<'a>> {
    let (mut fields, mut at) = (HashMap::new(), Some(name.to_owned()));
    let mut is_after_line = false;
    for line in text.lines().map(str::trim) {
        let line = line.split('#').next().unwrap_or_default().trim();
        if line.starts_with("====") {
            is_after_line = true;
        } else if let (true, Some(name)) = (is_after_line, line.strip_prefix("MSG:")) {
            (at, is_after_line) = (Some(short(name.trim())), false);
        } else if let (Some(field), Some(name)) = (field(line), at.as_ref()) {
            fields.entry(name.clone()).or_insert(field);
            at = None;
        }
    }
    fields
}

/// Returns the field in a line of a `.msg` file; `None` for a constant.
fn field(line: &str) -> Option<Field<'_>> {
    let (kind, rest) = line.split_once(char::is_whitespace)?;
    let rest = rest.trim_start();
    let end = rest.find(|c: char| c.is_whitespace() || c == '=');
    let (name, after) = rest.split_at(end.unwrap_or(rest.len()));
    if after.trim_start().starts_with('=') {
        return None;
    }
    let is_sequence = kind.ends_with("[]");
    Some(Field {
        // Another array is a type of its own name, which there is not.
        kind: kind.strip_suffix("[]").unwrap_or(kind),
        name,
        is_sequence,
    })
}

/// Returns the first field of each structure in a schema of IDL files.
fn idl_fields(text: &str) -> HashMap<String, Field<'_>> {
    let mut fields = HashMap::new();
    let (mut modules, mut name, mut is_in_struct) = (Vec::new(), None, false);
    for line in text.lines().map(str::trim) {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            [first, ..] if first.starts_with("====") => {
                (modules, name, is_in_struct) = (Vec::new(), None, false);
            }
            ["module", module, ..] => modules.push(module.trim_end_matches('{')),
            ["struct", structure, ..] => {
                let structure = structure.trim_end_matches('{');
                let full = modules.iter().copied().chain([structure]);
                name = Some(short(&full.collect::<Vec<_>>().join("/")));
                is_in_struct = true;
            }
            ["};" | "}", ..] if is_in_struct => (name, is_in_struct) = (None, false),
            ["};" | "}", ..] => drop(modules.pop()),
            [kind, field] if name.is_some() && field.ends_with(';') => {
                let sequence = kind.strip_prefix("sequence<");
                let of = sequence.and_then(|kind| kind.strip_suffix('>'));
                let field = Field {
                    kind: of.unwrap_or(kind),
                    name: field.trim_end_matches(';'),
                    is_sequence: of.is_some(),
                };
                fields.extend(name.take().map(|name| (name, field)));
            }
            // Another first field, such as an array: no stamp can come after it.
            [.., last] if last.ends_with(';') => name = None,
            _ => {}
        }
    }
    fields
}

impl StampField {
    /// Returns the stamp (ns) in the first bytes of a message in CDR; 0 if there is none.
    pub fn read(self, data: &[u8]) -> i64 {
        if self == Self::Json {
            return json_time(data).unwrap_or(0);
        }
        let is_little = data.get(1).is_some_and(|options| options & 1 == 1);
        let word = |at: usize| {
            let bytes = data.get(at..)?.first_chunk::<4>()?;
            Some(if is_little {
                u32::from_le_bytes(*bytes)
            } else {
                u32::from_be_bytes(*bytes)
            })
        };
        let time = |at| {
            let (seconds, nanos) = (word(at)?.cast_signed(), word(at + 4)?);
            Some(i64::from(seconds) * 1_000_000_000 + i64::from(nanos))
        };
        let micros = || {
            let (one, two) = (u64::from(word(4)?), u64::from(word(8)?));
            let value = if is_little {
                two << 32 | one
            } else {
                one << 32 | two
            };
            i64::try_from(value).ok()?.checked_mul(1_000)
        };
        let stamp = match self {
            Self::Time => time(4),
            Self::Micros => micros(),
            Self::Json => None,
            Self::FirstOfSequence => word(4).filter(|count| *count > 0).and_then(|_| time(8)),
        };
        stamp.unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str =
        "====\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n";

    #[test]
    fn the_stamp_is_in_the_first_field_followed_down() {
        let line = "=".repeat(80);
        for (schema, expected) in [
            (
                "# text\nuint8 A=1\nstring B = \"x\"\nstd_msgs/Header header\nfloat64 x",
                Some(StampField::Time),
            ),
            ("Header header\n", Some(StampField::Time)),
            ("builtin_interfaces/Time stamp\n", Some(StampField::Time)),
            ("uint64 timestamp # us\n", Some(StampField::Micros)),
            ("float64 x\nstd_msgs/Header header\n", None),
            (
                "Part[] parts\nLINE\nMSG: own/Part\nstd_msgs/Header header\n",
                Some(StampField::FirstOfSequence),
            ),
            (
                "Part[2] parts\nLINE\nMSG: own/Part\nstd_msgs/Header header\n",
                None,
            ),
            ("Part[] parts\nLINE\nMSG: own/Part\nuint8[] data\n", None),
            ("Own own\n", None),
            ("Own own\nLINE\nMSG: own/Own\nOwn own\n", None),
        ] {
            let text = format!("{}{HEADER}", schema.replace("LINE", &line))
                .replace("====\n", &format!("{line}\n"));
            let found = stamp_field("own/msg/Own", "ros2msg", text.as_bytes());
            assert_eq!(found, expected, "{schema}");
        }
    }

    #[test]
    fn idl_and_types_without_schemas_have_their_stamps() {
        let header = "std_msgs::msg::Header header;\n double x;";
        let constants = "module Own_Constants {\n const long A = 1;\n };\n";
        for (before, fields, stamp) in [
            ("", header.to_owned(), Some(StampField::Time)),
            (constants, header.to_owned(), Some(StampField::Time)),
            ("", format!("sequence<double, 3> a;\n {header}"), None),
            ("", format!("@key long id;\n {header}"), None),
        ] {
            let idl = format!(
                "module own {{\n module msg {{\n {before} struct Own {{\n {fields}\n }};\n}};\n}};"
            );
            let found = stamp_field("own/msg/Own", "ros2idl", idl.as_bytes());
            assert_eq!(found, stamp, "{idl}");
        }
        assert_eq!(
            stamp_field("sensor_msgs/msg/Imu", "", b""),
            Some(StampField::Time)
        );
        assert_eq!(stamp_field("std_msgs/msg/String", "", b""), None);
    }

    #[test]
    fn stamps_of_both_orders_of_bytes_and_of_cut_messages_are_read() {
        let little = [0, 1, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0];
        let big = [0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 3];
        for data in [little, big] {
            assert_eq!(StampField::Time.read(&data), 2_000_000_003);
        }
        assert_eq!(StampField::Micros.read(&little), ((3 << 32) + 2) * 1_000);
        assert_eq!(
            StampField::FirstOfSequence.read(&[0, 1, 0, 0, 0, 0, 0, 0]),
            0
        );
        assert_eq!(StampField::Time.read(&little[..9]), 0);
    }
}

/// The time at the beginning of JSON such as `{"header":{"stamp":{"sec":1,"nanosec":2}}`.
fn json_time(data: &[u8]) -> Option<i64> {
    let mut rest = data;
    // The names of fields that hold the time, from the outside.
    loop {
        rest = after(rest, b"{")?;
        let (name, value) = named(rest)?;
        rest = value;
        match name {
            b"header" | b"stamp" | b"timestamp" => {}
            b"sec" => break,
            _ => return None,
        }
    }
    let (seconds, rest) = number(rest)?;
    let (name, rest) = named(after(rest, b",")?)?;
    let (nanos, _) = number(rest)?;
    let is_time = matches!(name, b"nanosec" | b"nsec");
    let nanos = Some(nanos).filter(|nanos| is_time && *nanos < 1_000_000_000)?;
    seconds.checked_mul(1_000_000_000)?.checked_add(nanos)
}

/// What follows `sign`, spaces aside.
fn after<'a>(text: &'a [u8], sign: &[u8]) -> Option<&'a [u8]> {
    let rest = text.trim_ascii_start().strip_prefix(sign)?;
    Some(rest.trim_ascii_start())
}

/// The name of a field, and its value with what follows.
fn named(text: &[u8]) -> Option<(&[u8], &[u8])> {
    let text = after(text, b"\"")?;
    let end = text.iter().position(|byte| *byte == b'"')?;
    Some((&text[..end], after(&text[end + 1..], b":")?))
}

/// A whole number, and what follows.
fn number(text: &[u8]) -> Option<(i64, &[u8])> {
    let end = text.iter().position(|byte| !byte.is_ascii_digit())?;
    let digits = std::str::from_utf8(&text[..end]).ok()?;
    Some((digits.parse().ok()?, &text[end..]))
}

#[cfg(test)]
mod json_tests {
    use super::*;

    #[test]
    fn the_stamp_of_json_is_its_first_field() {
        for (text, stamp) in [
            (
                r#"{"header":{"stamp":{"sec":1,"nanosec":25}},"x":3}"#,
                1_000_000_025,
            ),
            (
                r#" { "timestamp" : { "sec" : 2, "nsec" : 5 } }"#,
                2_000_000_005,
            ),
            (r#"{"x":{"stamp":{"sec":1,"nanosec":25}}}"#, 0),
            (r#"{"stamp":{"sec":1,"nanosec":1000000000}}"#, 0),
            (r#"{"stamp":{"sec":99999999999999999999,"nanosec":1}}"#, 0),
            (r#"{"stamp":{"sec":9999999999,"nanosec":1}}"#, 0),
            (r#"{"stamp":{"sec":1"#, 0),
            ("", 0),
        ] {
            let found = StampField::Json.read(text.as_bytes());
            assert_eq!(found, stamp, "{text}");
        }
    }
}
