//! Notifications from the operating system about changes of interfaces and addresses: on Linux from
//! rtnetlink, on other systems none.

#[cfg(not(target_os = "linux"))]
pub(crate) use elsewhere::Changes;
#[cfg(target_os = "linux")]
pub(crate) use linux::Changes;

#[cfg(target_os = "linux")]
mod linux {
    use std::io;
    use std::os::fd::OwnedFd;

    use rustix::io::Errno;
    use rustix::net::netlink::SocketAddrNetlink;
    use rustix::net::{AddressFamily, RecvFlags, SocketFlags, SocketType, bind, recv, socket_with};
    use tokio::io::Interest;
    use tokio::io::unix::AsyncFd;

    use crate::link::watch::watch;

    /// `RTMGRP_LINK`, `RTMGRP_IPV4_IFADDR` and `RTMGRP_IPV6_IFADDR`: added, removed or changed
    /// interfaces, and their addresses.
    const GROUPS: u32 = 0x1 | 0x10 | 0x100;

    /// A listener for changes.
    #[derive(Debug)]
    pub(crate) struct Changes(Option<AsyncFd<OwnedFd>>);

    impl Changes {
        /// Listens from now on, if the operating system permits. Must be called within a tokio
        /// runtime.
        pub(crate) fn open() -> Self {
            let socket = listen();
            if let Err(error) = &socket {
                tracing::info!(%error, "no interface notifications; polling instead");
            }
            Self(socket.ok())
        }

        /// Whether the operating system announces changes.
        pub(crate) const fn are_announced(&self) -> bool {
            self.0.is_some()
        }

        /// Waits until something has changed.
        pub(crate) async fn next(&mut self) {
            if let Some(socket) = &self.0 {
                // The caller looks up the changes itself, after an error too.
                let _ = socket.readable().await;
            } else {
                std::future::pending::<()>().await;
            }
        }

        /// Discards the changes announced so far.
        pub(crate) fn forget(&mut self) {
            let Some(socket) = &self.0 else {
                return;
            };
            let read = |socket: &OwnedFd| {
                let mut message = [0; 4096];
                match recv(socket, &mut message[..], RecvFlags::DONTWAIT) {
                    // More was announced than was read, or a signal arrived.
                    Err(Errno::NOBUFS | Errno::INTR) => Ok(()),
                    other => other.map(|_| ()).map_err(io::Error::from),
                }
            };
            while socket.try_io(Interest::READABLE, read).is_ok() {}
        }
    }

    fn listen() -> io::Result<AsyncFd<OwnedFd>> {
        let flags = SocketFlags::NONBLOCK | SocketFlags::CLOEXEC;
        let (family, kind) = (AddressFamily::NETLINK, SocketType::RAW);
        // Protocol 0, the default, is rtnetlink.
        let socket = socket_with(family, kind, flags, None)?;
        bind(&socket, &SocketAddrNetlink::new(0, GROUPS))?;
        watch(socket, Interest::READABLE)
    }
}

#[cfg(not(target_os = "linux"))]
mod elsewhere {
    /// A listener that never reports a change.
    #[derive(Debug)]
    pub(crate) struct Changes;

    impl Changes {
        pub(crate) const fn open() -> Self {
            Self
        }

        pub(crate) const fn are_announced(&self) -> bool {
            false
        }

        pub(crate) async fn next(&mut self) {
            std::future::pending().await
        }

        pub(crate) const fn forget(&mut self) {}
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::Changes;

    #[tokio::test]
    async fn linux_announces_changes() {
        assert!(Changes::open().are_announced());
    }
}
