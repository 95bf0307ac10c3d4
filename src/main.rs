//! The `lampyris` command.

fn main() -> std::process::ExitCode {
    lampyris::cli::run(std::env::args_os())
}
