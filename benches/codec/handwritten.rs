//! Hand-written minimal codecs for three of the messages: all fields present, no checks except the
//! length, no field names in errors.

use bytes::Bytes;

/// ReportGlobalPose with all fields.
pub(crate) struct Pose {
    words: [u32; 5],
    shorts: [u16; 4],
}

impl Pose {
    pub(crate) fn decode(octets: &Bytes) -> Self {
        let octets: &[u8; 32] = octets[..].try_into().unwrap();
        let word = |at: usize| u32::from_le_bytes(octets[at..at + 4].try_into().unwrap());
        let short = |at: usize| u16::from_le_bytes(octets[at..at + 2].try_into().unwrap());
        Self {
            words: [word(4), word(8), word(12), word(16), word(28)],
            shorts: [short(20), short(22), short(24), short(26)],
        }
    }

    pub(crate) fn encode(&self, buffer: &mut Vec<u8>) {
        let mut octets = [0; 32];
        octets[..4].copy_from_slice(&[0x02, 0x44, 0xff, 0x01]);
        for (place, word) in [4, 8, 12, 16, 28].into_iter().zip(self.words) {
            octets[place..place + 4].copy_from_slice(&word.to_le_bytes());
        }
        for (place, short) in [20, 22, 24, 26].into_iter().zip(self.shorts) {
            octets[place..place + 2].copy_from_slice(&short.to_le_bytes());
        }
        buffer.extend_from_slice(&octets);
    }
}

/// SetElement.
pub(crate) struct Elements {
    request: u8,
    elements: Vec<([u16; 3], u8, Bytes)>,
}

impl Elements {
    pub(crate) fn decode(octets: &Bytes) -> Self {
        let mut at = 4;
        let mut elements = Vec::with_capacity(octets[3].into());
        for _ in 0..octets[3] {
            let short = |i: usize| u16::from_le_bytes([octets[at + i], octets[at + i + 1]]);
            let ids = [short(0), short(2), short(4)];
            let (format, length) = (octets[at + 6], usize::from(short(7)));
            elements.push((ids, format, octets.slice(at + 9..at + 9 + length)));
            at += 9 + length;
        }
        Self {
            request: octets[2],
            elements,
        }
    }

    pub(crate) fn encode(&self, buffer: &mut Vec<u8>) {
        buffer.extend_from_slice(&[0x1a, 0x04, self.request, self.elements.len() as u8]);
        for (ids, format, data) in &self.elements {
            for id in ids {
                buffer.extend_from_slice(&id.to_le_bytes());
            }
            buffer.push(*format);
            buffer.extend_from_slice(&(data.len() as u16).to_le_bytes());
            buffer.extend_from_slice(data);
        }
    }
}

/// ReportServices.
pub(crate) mod services {
    use super::Bytes;

    pub(crate) type Service = (Bytes, u8, u8);
    pub(crate) type Component = (u8, u8, Vec<Service>);
    pub(crate) type Node = (u8, Vec<Component>);

    pub(crate) fn decode(octets: &Bytes) -> Vec<Node> {
        let mut at = 2;
        let mut octet = |count: usize| {
            at += count;
            (octets[at - count], at)
        };
        let nodes = octet(1).0;
        let mut list = Vec::with_capacity(nodes.into());
        for _ in 0..nodes {
            let (node, components) = (octet(1).0, octet(1).0);
            let mut component_list = Vec::with_capacity(components.into());
            for _ in 0..components {
                let (component, instance, services) = (octet(1).0, octet(1).0, octet(1).0);
                let mut service_list = Vec::with_capacity(services.into());
                for _ in 0..services {
                    let (length, start) = octet(1);
                    let end = octet(length.into()).1;
                    service_list.push((octets.slice(start..end), octet(1).0, octet(1).0));
                }
                component_list.push((component, instance, service_list));
            }
            list.push((node, component_list));
        }
        list
    }

    pub(crate) fn encode(nodes: &[Node], buffer: &mut Vec<u8>) {
        buffer.extend_from_slice(&[0x03, 0x4b, nodes.len() as u8]);
        for (node, components) in nodes {
            buffer.extend_from_slice(&[*node, components.len() as u8]);
            for (component, instance, services) in components {
                buffer.extend_from_slice(&[*component, *instance, services.len() as u8]);
                for (uri, major, minor) in services {
                    buffer.push(uri.len() as u8);
                    buffer.extend_from_slice(uri);
                    buffer.extend_from_slice(&[*major, *minor]);
                }
            }
        }
    }
}
