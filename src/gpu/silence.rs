//! What drivers and their loaders print, which is no message of faircurve.

/// Does something while what others print to stderr is kept from the user, where that can be done.
pub fn silently<T>(act: impl FnOnce() -> T) -> T {
    #[cfg(unix)]
    let _silence = Silence::of_stderr();
    act()
}

/// Sends stderr nowhere until it is dropped.
#[cfg(unix)]
struct Silence {
    stderr: std::os::fd::OwnedFd,
}

#[cfg(unix)]
impl Silence {
    fn of_stderr() -> std::io::Result<Silence> {
        use std::os::fd::AsFd;
        let stderr = std::io::stderr().as_fd().try_clone_to_owned()?;
        let nowhere = std::fs::OpenOptions::new().write(true).open("/dev/null")?;
        rustix::stdio::dup2_stderr(nowhere)?;
        Ok(Silence { stderr })
    }
}

#[cfg(unix)]
impl Drop for Silence {
    fn drop(&mut self) {
        // Where this fails there is nobody to tell.
        let _ = rustix::stdio::dup2_stderr(&self.stderr);
    }
}
