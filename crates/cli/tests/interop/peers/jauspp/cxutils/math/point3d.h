#ifndef CXUTILS_MATH_POINT3D_H
#define CXUTILS_MATH_POINT3D_H

#include "cxmath.h"

namespace CxUtils {

class Point3D {
public:
    enum Axis { X, Y, Z };

    Point3D() = default;
    Point3D(double x, double y, double z) : mX(x), mY(y), mZ(z) {}

    void Set(double x, double y, double z) { *this = Point3D(x, y, z); }

    // Rotated by an angle in radians.
    Point3D Rotate(double angle, int axis) const
    {
        const double c = std::cos(angle), s = std::sin(angle);
        switch (axis) {
        case X:
            return Point3D(mX, c * mY - s * mZ, s * mY + c * mZ);
        case Y:
            return Point3D(c * mX + s * mZ, mY, c * mZ - s * mX);
        default:
            return Point3D(c * mX - s * mY, s * mX + c * mY, mZ);
        }
    }

    double mX = 0;
    double mY = 0;
    double mZ = 0;
};

// Angles in radians.
class Orientation {
public:
    // In -π to π.
    static double AddToAngle(double angle, double change) { return std::remainder(angle + change, 2 * CX_PI); }
    static double AngleDiff(double from, double to) { return std::remainder(to - from, 2 * CX_PI); }
};

} // namespace CxUtils

#endif
