// A controller of foot-bots that avoid each other and the walls in ARGoS 3, and the end of the measurement.
//
// Prints the number of robot-steps and their processor time, s. A step is 50 ms.

#include <cstdio>
#include <ctime>

#include <argos3/core/control_interface/ci_controller.h>
#include <argos3/core/simulator/loop_functions.h>
#include <argos3/plugins/robots/foot-bot/control_interface/ci_footbot_proximity_sensor.h>
#include <argos3/plugins/robots/generic/control_interface/ci_differential_steering_actuator.h>
#include <argos3/plugins/robots/generic/control_interface/ci_range_and_bearing_actuator.h>
#include <argos3/plugins/robots/generic/control_interface/ci_range_and_bearing_sensor.h>

using namespace argos;

// 2.5 radii of a foot-bot per second, cm/s.
static const Real SPEED = 21.25;
static const UInt64 WARM_UP = 20;

class Wanderer : public CCI_Controller {
public:
	void Init(TConfigurationNode &node) override {
		bool has_radio;
		GetNodeAttribute(node, "radio", has_radio);
		wheels = GetActuator<CCI_DifferentialSteeringActuator>("differential_steering");
		proximity = GetSensor<CCI_FootBotProximitySensor>("footbot_proximity");
		if (has_radio) {
			sender = GetActuator<CCI_RangeAndBearingActuator>("range_and_bearing");
			receiver = GetSensor<CCI_RangeAndBearingSensor>("range_and_bearing");
		}
	}

	void ControlStep() override {
		// Readings 0 to 5 are front left, and 18 to 23 front right.
		const CCI_FootBotProximitySensor::TReadings &readings = proximity->GetReadings();
		Real left = 0, right = 0;
		for (size_t place = 0; place < 6; place++) {
			left += readings[place].Value;
			right += readings[readings.size() - 1 - place].Value;
		}
		const bool near = left + right > 0;
		wheels->SetLinearVelocity(near && right > left ? -SPEED : SPEED, near && right <= left ? -SPEED : SPEED);
		if (sender) {
			sender->SetData(0, UInt8(heard));
			heard = receiver->GetReadings().size();
		}
	}

private:
	CCI_DifferentialSteeringActuator *wheels = nullptr;
	CCI_FootBotProximitySensor *proximity = nullptr;
	CCI_RangeAndBearingActuator *sender = nullptr;
	CCI_RangeAndBearingSensor *receiver = nullptr;
	// The number of robots from which the last step received.
	size_t heard = 0;
};

class Measurement : public CLoopFunctions {
public:
	void Init(TConfigurationNode &node) override {
		GetNodeAttribute(node, "robots", robots);
		GetNodeAttribute(node, "seconds", seconds);
	}

	void PostStep() override {
		if (++ticks == WARM_UP)
			began = clock();
	}

	bool IsExperimentFinished() override {
		const double spent = double(clock() - began) / CLOCKS_PER_SEC;
		if (ticks <= WARM_UP || spent < seconds)
			return false;
		printf("%lu %f\n", (ticks - WARM_UP) * robots, spent);
		fflush(stdout);
		return true;
	}

private:
	UInt64 robots = 0, ticks = 0;
	Real seconds = 0;
	clock_t began = 0;
};

REGISTER_CONTROLLER(Wanderer, "wanderer")
REGISTER_LOOP_FUNCTIONS(Measurement, "measurement")
