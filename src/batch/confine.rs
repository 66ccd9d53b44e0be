//! Limits that the system holds a worker to. The only file that names rustix; beyond Linux there are none.

/// Makes this process die with the thread that started it, and leave no core dump.
pub fn die_with_parent() {
    #[cfg(target_os = "linux")]
    {
        use rustix::process::{Resource, Rlimit, Signal, set_parent_process_death_signal, setrlimit};
        // Where the system refuses, a worker ends when its input does.
        let _ = set_parent_process_death_signal(Some(Signal::KILL));
        let _ = setrlimit(Resource::Core, Rlimit { current: Some(0), maximum: Some(0) });
    }
}

/// Lets this process take `more` bytes of memory of its own than it has now; an allocation beyond that ends it. Whether the system
/// does so.
pub fn limit_memory(more: u64) -> bool {
    #[cfg(target_os = "linux")]
    {
        use rustix::process::{Resource, Rlimit, setrlimit};
        let Some(now) = data_bytes() else { return false };
        let current = Some(now.saturating_add(more));
        setrlimit(Resource::Data, Rlimit { current, maximum: current }).is_ok()
    }
    #[cfg(not(target_os = "linux"))]
    {
        let _ = more;
        false
    }
}

/// Bytes of this process that are its own and can be written to, as the limit counts them.
#[cfg(target_os = "linux")]
fn data_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmData:"))?;
    line.trim().strip_suffix(" kB")?.trim().parse::<u64>().ok().map(|kib| kib * 1024)
}
