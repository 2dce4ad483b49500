//! A panic is a bug: says so, and what helps to find it. The exit code stays 101.

/// Puts our words behind those of the standard hook.
pub fn report_panics() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        usual(panic);
        let version = env!("CARGO_PKG_VERSION");
        let place = match option_env!("CARGO_PKG_REPOSITORY") {
            Some(page) if !page.is_empty() => format!("at {page}/issues"),
            _ => "to the authors of Lacuna".into(),
        };
        eprintln!(
            "lacuna: this is a bug in lacuna {version}, not in your data. Please report it {place}: the message \
             above, the command line, and if possible the file."
        );
    }));
}
