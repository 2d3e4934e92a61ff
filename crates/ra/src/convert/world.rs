//! Vector knowledge store, 0A20h to 4A24h. Our service adopted the messages octet by octet: what
//! both definitions decode is passed on unchanged. (At the ends of their ranges positions differ by
//! half a step, 5 mm at most: we divide a range by 2^32 - 1, RA by 2^32 - 2.)

use super::pair::Pair;
use crate::messages::ra33;
use jaus_vehicle::messages::ground;

pub(super) const PAIRS: &[Pair] = &[
    Pair::same_octets::<ra33::CreateVksObjects, ground::CreateVksObjects>(),
    Pair::same_octets::<ra33::SetVksFeatureClassMetadata, ground::SetVksFeatureClassMetadata>(),
    Pair::same_octets::<ra33::TerminateVksDataTransfer, ground::TerminateVksDataTransfer>(),
    Pair::same_octets::<ra33::DeleteVksObjects, ground::DeleteVksObjects>(),
    Pair::same_octets::<ra33::QueryVksFeatureClassMetadata, ground::QueryVksFeatureClassMetadata>(),
    Pair::same_octets::<ra33::QueryVksBounds, ground::QueryVksBounds>(),
    Pair::same_octets::<ra33::QueryVksObjects, ground::QueryVksObjects>(),
    Pair::same_octets::<ra33::ReportVksObjectsCreation, ground::ReportVksObjectsCreation>(),
    Pair::same_octets::<ra33::ReportVksFeatureClassMetadata, ground::ReportVksFeatureClassMetadata>(
    ),
    Pair::same_octets::<ra33::ReportVksBounds, ground::ReportVksBounds>(),
    Pair::same_octets::<ra33::ReportVksObjects, ground::ReportVksObjects>(),
    Pair::same_octets::<
        ra33::ReportVksDataTransferTermination,
        ground::ReportVksDataTransferTermination,
    >(),
];
