// Positions on the earth, taken for a sphere: only differences over some hundred metres matter here.
#ifndef CXUTILS_MATH_COORDINATES_H
#define CXUTILS_MATH_COORDINATES_H

#include "point3d.h"

namespace CxUtils {

const double CX_EARTH_RADIUS = 6371008.8;

// Latitude and longitude in degrees, elevation in metres.
class Wgs {
public:
    Wgs() = default;
    Wgs(double latitude, double longitude, double elevation)
        : mLatitude(latitude), mLongitude(longitude), mElevation(elevation)
    {
    }

    void Set(double latitude, double longitude, double elevation) { *this = Wgs(latitude, longitude, elevation); }

    static double GreatCircleDistance(const Wgs& a, const Wgs& b)
    {
        const double latitude = std::sin(CxToRadians(b.mLatitude - a.mLatitude) / 2);
        const double longitude = std::sin(CxToRadians(b.mLongitude - a.mLongitude) / 2);
        const double cosines = std::cos(CxToRadians(a.mLatitude)) * std::cos(CxToRadians(b.mLatitude));
        const double h = latitude * latitude + cosines * longitude * longitude;
        return 2 * CX_EARTH_RADIUS * std::asin(std::sqrt(h));
    }

    double mLatitude = 0;
    double mLongitude = 0;
    double mElevation = 0;
};

// Metres to the north and to the east.
class Utm {
public:
    Utm() = default;
    explicit Utm(const Wgs& position)
        : mNorthing(CX_EARTH_RADIUS * CxToRadians(position.mLatitude)),
          mEasting(CX_EARTH_RADIUS * CxToRadians(position.mLongitude) * std::cos(CxToRadians(position.mLatitude))),
          mElevation(position.mElevation)
    {
    }

    double mNorthing = 0;
    double mEasting = 0;
    double mElevation = 0;
};

} // namespace CxUtils

#endif
