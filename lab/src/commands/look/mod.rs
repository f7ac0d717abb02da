//! `ratelab look`: what the times in a bag say.

mod json;
mod table;

use ratelab_bag::Analysis;

use crate::{
    bag_file,
    cli::LookArgs,
    error::Error,
    output::{print_data, print_line},
    printable::shown,
};

/// Prints what a bag says of its topics, clocks, nodes and chains.
pub fn look(args: &LookArgs) -> Result<(), Error> {
    let bag = bag_file::read(&args.file)?;
    let analysis = Analysis::new(&bag);
    if args.json {
        print_data(&format!("{:#}", json::value(&bag, &analysis)))?;
    } else {
        print_line(&table::text(&shown(&args.file), &bag, &analysis))?;
    }
    bag_file::if_damaged(&bag)
}
