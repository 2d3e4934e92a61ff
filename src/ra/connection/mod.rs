//! Service connections: the Reference Architecture's way to be told something regularly.
