//! Local and Global Operating Zone: sets, deletes and reports the zones of a world.
//!
//! The messages have two peculiarities. Each vertex of a keep-out zone repeats the zone's number,
//! and a Set has no answer: clients learn of its end by a command event, or query the zones.

#[cfg(test)]
mod tests;

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use crate::motion::Frame;
use crate::world::{Change, Outline, World};
use crate::zones::{Point, Polygon, ZoneId, Zones};
use jaus::codec::{Message, OutOfRange, ServiceId};
use jaus::endpoint::Received;
use jaus::messages::mobility::report_excursion::{ExcursionRec, ZoneStatus};
use jaus::messages::mobility::set_global_operating_zone::{
    GlobalExclusionZoneRec, GlobalExclusionZoneSeq, GlobalPolygonPointRec, Latitude, Longitude,
};
use jaus::messages::mobility::set_local_operating_zone::{
    LocalExclusionZoneRec, LocalExclusionZoneSeq, LocalPolygonPointRec, X, Y,
};
use jaus::messages::mobility::{
    DeleteZone, QueryExcursion, QueryGlobalOperatingZone, QueryLocalOperatingZone, ReportExcursion,
    ReportGlobalOperatingZone, ReportLocalOperatingZone, SetGlobalOperatingZone,
    SetLocalOperatingZone, delete_zone, global_operating_zone, local_operating_zone,
};
use jaus::service::{Context, Handled, Hazards, Service, code_of, read};

use super::WorldStore;
use super::world_store::Answer;

/// The zones of a world. Clients in control set and delete them, any client queries them.
///
/// A Set replaces the zones that it names and keeps the others; an empty operating zone keeps the
/// present one. If one of its zones is invalid, none is set. Bounds of the height are ignored: the
/// vehicle drives on the ground. Cheap to clone; all clones share one state.
#[derive(Debug, Clone)]
pub struct OperatingZones {
    store: WorldStore,
    /// The vehicle's position in the local frame, if known.
    place: Arc<Mutex<Option<Point>>>,
}

impl OperatingZones {
    pub(super) fn new(store: WorldStore) -> Self {
        Self {
            store,
            place: Arc::default(),
        }
    }

    /// Sets the vehicle's position in the local frame. Returns whether Report Excursion has changed.
    #[must_use]
    pub fn handle_place(&self, place: Option<Point>) -> bool {
        let before = self.excursion(0);
        *self.place.lock().unwrap_or_else(PoisonError::into_inner) = place;
        before != self.excursion(0)
    }

    /// Whether a message sets zones that do not exist yet, and so only restricts a vehicle.
    pub(crate) fn only_adds(&self, message: &Received) -> bool {
        let outlines = match code_of(&message.payload) {
            Some(SetLocalOperatingZone::CODE) => read(message).map(|set| from_local(&set)),
            Some(SetGlobalOperatingZone::CODE) => read(message).map(|set| from_global(&set)),
            _ => None,
        };
        let Some(Ok(outlines)) = outlines else {
            return false;
        };
        let is_new = |world: &World| {
            outlines
                .iter()
                .all(|it| !world.zones().contains_key(&it.id))
        };
        self.store.ask(is_new).unwrap_or_default()
    }

    fn set(
        &self,
        now: Instant,
        message: &Received,
        outlines: Result<Vec<Outline>, String>,
        context: &mut Context<'_>,
    ) {
        let frame = self.store.frame();
        let checked = outlines.and_then(|outlines| {
            let fault = outlines.iter().find_map(|it| it.polygon(frame).err());
            fault.map_or(Ok(outlines), |fault| Err(fault.to_string()))
        });
        match checked {
            Ok(outlines) => self.change(now, message, Change::SetZones(outlines), context),
            Err(why) => {
                tracing::warn!(source = %message.source, "zones refused: {why}");
                context.ended(code_of(&message.payload).unwrap_or_default(), false);
            }
        }
    }

    fn delete(&self, now: Instant, message: &Received, context: &mut Context<'_>) {
        if let Some(delete) = read::<DeleteZone>(message) {
            let ids = delete.zone_id_list.iter();
            let ids = ids.filter_map(|it| ZoneId::of(it.zone_id.0)).collect();
            self.change(now, message, Change::RemoveZones(ids), context);
        }
    }

    fn change(&self, now: Instant, message: &Received, change: Change, context: &mut Context<'_>) {
        let answer = Answer::Command(code_of(&message.payload).unwrap_or_default());
        self.store.change(now, message, change, answer, context);
    }

    /// The zones with this number, 0 for all, as `vertices` gives their vertices.
    fn outlines(
        &self,
        number: u16,
        vertices: impl Fn(&Outline, &Frame) -> Vec<Point>,
    ) -> Option<Outlines> {
        let frame = *self.store.frame();
        self.store.ask(|world| {
            let zones = world.zones().values();
            let mut found = Outlines::default();
            for zone in zones.filter(|zone| number == 0 || zone.id.number() == number) {
                match zone.id {
                    ZoneId::Operating => found.operating = vertices(zone, &frame),
                    id => found.keep_out.push((id, vertices(zone, &frame))),
                }
            }
            found
        })
    }

    /// Where the vehicle is with respect to the zones; nothing while its position is unknown.
    fn excursion(&self, number: u16) -> ReportExcursion {
        let place = *self.place.lock().unwrap_or_else(PoisonError::into_inner);
        let frame = *self.store.frame();
        let excursion = self.store.ask(|world| {
            let zones = world.zones().values();
            let zones = zones.filter(|zone| number == 0 || zone.id.number() == number);
            let inside = |zone: &Outline, place| {
                // Only valid outlines are kept.
                let polygon = zone.polygon(&frame);
                polygon.is_ok_and(|it: Polygon| it.signed_distance(place) < 0.0)
            };
            zones
                .zip(std::iter::repeat(place))
                .filter_map(|(zone, place)| {
                    let zone_status = match (zone.id, inside(zone, place?)) {
                        (ZoneId::Operating, false) => ZoneStatus::OUTSIZE_SAFE_OP_ZONE,
                        (ZoneId::KeepOut(_), true) => {
                            ZoneStatus::INSIDE_SAFE_OP_ZONE_AND_INSIDE_EXCLUSION_ZONE
                        }
                        _ => ZoneStatus::INSIDE_SAFE_OP_ZONE,
                    };
                    Some(ExcursionRec {
                        zone_id: delete_zone::ZoneId(zone.id.number()),
                        zone_status,
                    })
                })
                // The count in the message is one octet.
                .take(usize::from(u8::MAX))
                .collect()
        });
        ReportExcursion {
            excursion: excursion.unwrap_or_default(),
        }
    }
}

impl Service for OperatingZones {
    fn offers(&self) -> Vec<ServiceId> {
        vec![local_operating_zone::LATEST, global_operating_zone::LATEST]
    }

    fn handle_message(
        &mut self,
        now: Instant,
        message: &Received,
        context: &mut Context<'_>,
    ) -> Handled {
        match code_of(&message.payload) {
            Some(code) if self.tells_end_of(code) && !context.standing().obeys(message.source) => {
                tracing::debug!(source = %message.source, "zones ignored: sender not in control");
            }
            Some(SetLocalOperatingZone::CODE) => {
                if let Some(set) = read(message) {
                    self.set(now, message, from_local(&set), context);
                }
            }
            Some(SetGlobalOperatingZone::CODE) => {
                if let Some(set) = read(message) {
                    self.set(now, message, from_global(&set), context);
                }
            }
            Some(DeleteZone::CODE) => self.delete(now, message, context),
            Some(QueryLocalOperatingZone::CODE) => {
                if let Some(query) = read::<QueryLocalOperatingZone>(message)
                    && let Some(zones) = self.outlines(query.query_zone_id.0, Outline::local)
                {
                    reply(message, zones.local(), context);
                }
            }
            Some(QueryGlobalOperatingZone::CODE) => {
                if let Some(query) = read::<QueryGlobalOperatingZone>(message)
                    && let Some(zones) = self.outlines(query.query_zone_id.0, Outline::global)
                {
                    reply(message, zones.global(), context);
                }
            }
            Some(QueryExcursion::CODE) => {
                if let Some(query) = read::<QueryExcursion>(message) {
                    context.reply(message, &self.excursion(query.query_zone_id.0));
                }
            }
            _ => return Handled::No,
        }
        Handled::Yes
    }

    fn handle_timeout(&mut self, now: Instant, context: &mut Context<'_>) {
        self.store.handle_timeout(now, context);
    }

    fn hazards(&self) -> Hazards {
        Hazards {
            set_up_by: Some(SetLocalOperatingZone::NAME),
            ..Hazards::default()
        }
    }

    fn tells_end_of(&self, command: u16) -> bool {
        matches!(
            command,
            SetLocalOperatingZone::CODE | SetGlobalOperatingZone::CODE | DeleteZone::CODE
        )
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.store.poll_timeout()
    }
}

/// Sends a report whose coordinates fit into its fields.
fn reply<R: Message>(message: &Received, report: Result<R, OutOfRange>, context: &mut Context<'_>) {
    match report {
        Ok(report) => context.reply(message, &report),
        Err(error) => tracing::debug!(report = R::NAME, %error, "cannot encode the zones"),
    }
}

/// The vertices of some zones, in the coordinates of one message.
#[derive(Default)]
struct Outlines {
    operating: Vec<Point>,
    keep_out: Vec<(ZoneId, Vec<Point>)>,
}

/// The conversion of outlines to and from the messages of one of the two services, which differ in
/// names only.
macro_rules! messages {
    (
        $read:ident($set:ident, $on_globe:literal), $write:ident -> $report:ident,
        $operating:ident, $keep_out:ident, $sequence:ident {
            $zone:ident: $zone_rec:ident, $point:ident: $point_rec:ident { $a:ident: $A:ident, $b:ident: $B:ident }
        }
    ) => {
        fn $read(set: &$set) -> Result<Vec<Outline>, String> {
            let place = |it: &$point_rec| (it.$a.value(), it.$b.value());
            let keep_out = set.$keep_out.iter().map(|zone| {
                let vertices = zone.iter();
                vertices.map(|it| (it.$zone.zone_id.0, place(&it.$point))).collect()
            });
            let operating = set.$operating.iter().map(place).collect();
            outlines($on_globe, operating, keep_out)
        }

        impl Outlines {
            fn $write(&self) -> Result<$report, OutOfRange> {
                let point = |&(a, b): &Point| {
                    Ok($point_rec {
                        $a: $A::new(a)?,
                        $b: $B::new(b)?,
                        ..$point_rec::default()
                    })
                };
                let zones = self.keep_out.iter().map(|(id, vertices)| {
                    let zone_id = delete_zone::ZoneId(id.number());
                    let vertex = |$point| $sequence {
                        $zone: $zone_rec { zone_id },
                        $point,
                    };
                    vertices.iter().map(|it| point(it).map(vertex)).collect()
                });
                Ok($report {
                    $operating: self.operating.iter().map(point).collect::<Result<_, _>>()?,
                    $keep_out: zones.collect::<Result<_, _>>()?,
                })
            }
        }
    };
}

messages!(
    from_local(SetLocalOperatingZone, false), local -> ReportLocalOperatingZone,
    local_operating_zone, local_exclusion_zones, LocalExclusionZoneSeq {
        local_exclusion_zone_rec: LocalExclusionZoneRec,
        local_polygon_point_rec: LocalPolygonPointRec { x: X, y: Y }
    }
);

messages!(
    from_global(SetGlobalOperatingZone, true), global -> ReportGlobalOperatingZone,
    global_operating_zone, global_exclusion_zones, GlobalExclusionZoneSeq {
        global_exclusion_zone_rec: GlobalExclusionZoneRec,
        global_polygon_point_rec: GlobalPolygonPointRec { latitude: Latitude, longitude: Longitude }
    }
);

/// The outlines of a message; the vertices of a keep-out zone have its number.
fn outlines(
    on_globe: bool,
    operating: Vec<Point>,
    keep_out: impl Iterator<Item = Vec<(u16, Point)>>,
) -> Result<Vec<Outline>, String> {
    let mut found = Vec::new();
    if !operating.is_empty() {
        found.push(Outline {
            id: ZoneId::Operating,
            on_globe,
            vertices: operating,
        });
    }
    for (index, zone) in keep_out.enumerate() {
        let number = zone.first().map_or(0, |&(number, _)| number);
        let id = ZoneId::of(number).filter(|&id| id != ZoneId::Operating);
        let id = id.filter(|_| zone.iter().all(|&(other, _)| other == number));
        let id = id.ok_or_else(|| {
            format!(
                "keep-out zone number {} of the message: give all of its vertices one number \
                 from 2 to 65535",
                index + 1
            )
        })?;
        found.push(Outline {
            id,
            on_globe,
            vertices: zone.into_iter().map(|(_, vertex)| vertex).collect(),
        });
    }
    Ok(found)
}

/// The zones in a report of Local Operating Zone.
///
/// # Errors
/// Why one of them is invalid.
pub fn reported_zones(report: &ReportLocalOperatingZone) -> Result<Zones, String> {
    let set = SetLocalOperatingZone {
        local_operating_zone: report.local_operating_zone.clone(),
        local_exclusion_zones: report.local_exclusion_zones.clone(),
    };
    let mut zones = Zones::default();
    for outline in from_local(&set)? {
        let polygon = Polygon::new(outline.vertices);
        let polygon = polygon.map_err(|error| format!("{}: {error}", outline.id))?;
        zones.set(outline.id, polygon);
    }
    Ok(zones)
}
