//! Examples at the end of each help text and manual page.

use clap::Command;

use crate::program;

/// Heading of the examples.
pub const EXAMPLES: &str = "Examples:\n";

/// Examples by command; the first are of the program itself.
const OF_COMMANDS: [(&str, &str); 20] = [
    (
        "",
        "\
  ratelab                     watch the graph run; ? tells the keys
  ratelab run --help          the options of one command, and examples",
    ),
    (
        "lab",
        "\
  ratelab lab --speed 0.2               slow motion: a fall one can follow
  ratelab lab --control-hz 15 --record  a slow policy, recorded",
    ),
    (
        "run",
        "\
  ratelab run --break                   decide 5 times a second: it falls
  ratelab run --clock virtual --record  the same to the bit every time, and kept
  ratelab run --world own --think-ms 60..80  neither waits for the other",
    ),
    (
        "sweep",
        "\
  ratelab sweep --control-hz 5,10,20,50 --seeds 0..199 --theory
  ratelab sweep --control-hz 5,10,20,50 --by age
  ratelab sweep --policy scripted,lqr --queue-depth 1,100
  ratelab sweep --control-hz 5,10,20,50 --queue-depth 1,10,100 --svg map.svg
  ratelab sweep --axis \"rate NODE\" 1,10,100 --csv runs.csv",
    ),
    (
        "hunt",
        "\
  ratelab hunt --control-hz 15 --lose 8
  ratelab hunt --world own --hang policy=1000 --save hang.knobs --record hang.rrd",
    ),
    (
        "new",
        "\
  ratelab new robot.toml                write an example
  ratelab robot.toml                    open the lab on it
  ratelab sweep robot.toml --axis \"rate planner\" 5,10,20
  ratelab new --schema > graph.json     for the completion of editors",
    ),
    (
        "replay",
        "\
  ratelab replay fall.rrd               in the rerun viewer
  ratelab replay --terminal fall.rrd    here, in the panes of the lab",
    ),
    ("info", "  ratelab info fall.rrd"),
    (
        "export-web",
        "  ratelab export-web recordings/*.rrd -o runs.html",
    ),
    (
        "picture",
        "\
  ratelab picture fall.rrd --at 0.8 --theme light -o fall.svg
  ratelab picture fall.rrd --animate 0.2 --size 80x24 -o fall.svg
  ratelab picture --control-hz 15 --at 5 --size 80x24",
    ),
    (
        "up",
        "\
  ratelab up                            plant and policy apart, and the dashboard
  ratelab up --duration-s 10 --control-hz 20",
    ),
    (
        "node",
        "\
  ratelab node plant                    here, and in another terminal:
  ratelab node policy --policy lqr
  ratelab node policy --connect tcp/ROBOT:7447",
    ),
    ("trace", "  ratelab trace fall.rrd -o fall.pftrace"),
    ("verify", "  ratelab verify recordings/*.rrd"),
    (
        "branch",
        "  ratelab branch real.rrd --at 0.4 --knob \"takes policy 0\"",
    ),
    (
        "exercise",
        "\
  ratelab exercise 1                    says what it is about, asks, measures
  ratelab exercise 10 --seed 17         a fault to find, drawn from your number
  ratelab exercise 1 --predict \"30 because fewer decisions come too late\"",
    ),
    ("grade", "  ratelab grade hand-ins --csv grades.csv"),
    ("tour", "  ratelab tour --theme light"),
    (
        "completions",
        "\
  ratelab completions bash > ~/.local/share/bash-completion/completions/ratelab
  ratelab completions fish > ~/.config/fish/completions/ratelab.fish",
    ),
    (
        "man",
        "\
  ratelab man | man -l -                read it now
  ratelab man ~/.local/share/man/man1   install it: man ratelab-run",
    ),
];

/// Adds to `command` the examples whose options it has.
pub fn add(command: Command) -> Command {
    let program = program::name();
    let name = command.get_name();
    let name = if name == program { "" } else { name };
    let known = |option: &str| {
        let mut options = command.get_arguments().filter_map(|arg| arg.get_long());
        option == "help" || options.any(|known| known == option)
    };
    let of_command = OF_COMMANDS.iter().find(|(of, _)| *of == name);
    let lines = of_command.map_or("", |(_, text)| text).lines();
    let lines = lines.filter(|line| {
        let mut words = line.split_whitespace();
        words.all(|word| word.strip_prefix("--").is_none_or(known))
    });
    let lines: Vec<String> = lines
        .map(|line| format!("  {}", line.trim().replace("ratelab", &program)))
        .collect();
    if lines.is_empty() {
        return command;
    }
    command.after_help(format!("{EXAMPLES}{}", lines.join("\n")))
}
