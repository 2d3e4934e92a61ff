// The simulated vehicle: a component with poses, velocity and a primitive driver.
#ifndef JAUSPP_PEER_VEHICLE_H
#define JAUSPP_PEER_VEHICLE_H

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>

#include <jaus/mobility/drivers/primitivedriver.h>
#include <jaus/mobility/sensors/globalposesensor.h>
#include <jaus/mobility/sensors/localposesensor.h>
#include <jaus/mobility/sensors/velocitystatesensor.h>

#include "component.h"

// Update rate of the vehicle's sensors.
constexpr double VEHICLE_HZ = 25;
// Speed at full effort in m/s, and the change of speed in m/s².
constexpr double FASTEST = 2;
constexpr double ACCELERATION = 1.5;
// Turn rate at full effort, in rad/s.
constexpr double TURN = 0.5;
// Where the vehicle starts, in radians.
constexpr double LATITUDE = 0.6;
constexpr double LONGITUDE = -1.4;
constexpr double EARTH_RADIUS = 6371008.8;

// Keeps the last effort of its controller.
class Driver : public JAUS::PrimitiveDriver {
public:
    bool SetWrenchEffort(const JAUS::SetWrenchEffort* command) override
    {
        const auto share = [](double percent) { return std::max(-100.0, std::min(percent, 100.0)) / 100; };
        if (command->IsFieldPresent(JAUS::SetWrenchEffort::PresenceVector::PropulsiveLinearEffortX))
            push = share(command->GetPropulsiveLinearEffortX());
        if (command->IsFieldPresent(JAUS::SetWrenchEffort::PresenceVector::PropulsiveRotationalEffortZ))
            turn = share(command->GetPropulsiveRotationalEffortZ());
        return true;
    }

    bool Reset() override
    {
        push = turn = 0;
        return PrimitiveDriver::Reset();
    }

    // Shares of full effort.
    std::atomic<double> push{0};
    std::atomic<double> turn{0};
};

struct Motion {
    double velocity = 0;
    double turn_rate = 0;
    double heading = 0;
    double north = 0;
    double east = 0;

    void move(double push, double turn, double seconds)
    {
        const double change = ACCELERATION * seconds;
        velocity += std::max(-change, std::min(push * FASTEST - velocity, change));
        turn_rate = turn * TURN;
        heading = std::remainder(heading + turn_rate * seconds, 2 * CxUtils::CX_PI);
        north += velocity * std::cos(heading) * seconds;
        east += velocity * std::sin(heading) * seconds;
    }
};

[[noreturn]] inline void vehicle(const JAUS::Address& id)
{
    // The component owns its services.
    JAUS::Component component;
    auto* global = new JAUS::GlobalPoseSensor();
    auto* local = new JAUS::LocalPoseSensor();
    auto* velocity = new JAUS::VelocityStateSensor();
    auto* driver = new Driver();
    global->SetSensorUpdateRate(VEHICLE_HZ);
    local->SetSensorUpdateRate(VEHICLE_HZ);
    velocity->SetSensorUpdateRate(VEHICLE_HZ);
    for (JAUS::Service* service : {static_cast<JAUS::Service*>(global), static_cast<JAUS::Service*>(local),
                                   static_cast<JAUS::Service*>(velocity), static_cast<JAUS::Service*>(driver)})
        require(component.AddService(service), "a service could not be added");
    start(component, id, JAUS::Subsystem::Vehicle);
    component.ManagementService()->SetStatus(JAUS::Management::Status::Standby);
    say("listening");

    Motion motion;
    for (;;) {
        const bool is_ready = component.ManagementService()->GetStatus() == JAUS::Management::Status::Ready;
        motion.move(is_ready ? driver->push.load() : 0, is_ready ? driver->turn.load() : 0, 1 / VEHICLE_HZ);
        const JAUS::Time now(true);
        JAUS::GlobalPose global_pose;
        global_pose.SetLatitude(CxUtils::CxToDegrees(LATITUDE + motion.north / EARTH_RADIUS));
        global_pose.SetLongitude(
            CxUtils::CxToDegrees(LONGITUDE + motion.east / (EARTH_RADIUS * std::cos(LATITUDE))));
        global_pose.SetAltitude(0);
        global_pose.SetYaw(motion.heading);
        global_pose.SetTimeStamp(now);
        JAUS::LocalPose local_pose;
        local_pose.SetX(motion.north);
        local_pose.SetY(motion.east);
        local_pose.SetZ(0);
        local_pose.SetYaw(motion.heading);
        local_pose.SetTimeStamp(now);
        JAUS::VelocityState state;
        state.SetVelocityX(motion.velocity);
        state.SetYawRate(motion.turn_rate);
        state.SetTimeStamp(now);
        global->SetGlobalPose(global_pose);
        local->SetLocalPose(local_pose);
        velocity->SetVelocityState(state);
        std::this_thread::sleep_for(std::chrono::duration<double>(1 / VEHICLE_HZ));
    }
}

#endif
