// Robots that avoid each other and the walls in Enki: enki ROBOTS SECONDS
//
// Prints the number of robot-steps and their processor time, s. A step is 50 ms.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>

#include <enki/PhysicalEngine.h>
#include <enki/robots/e-puck/EPuck.h>

// Radius of an e-puck, cm. The side of a robot's share of the arena is 30 radii, and the speed is 2.5 radii per second.
static const double RADIUS = 3.7;
static const double SHARE = 30 * RADIUS;
static const double SPEED = 2.5 * RADIUS;
// Distance at which a robot turns, cm.
static const double NEAR = 6;
static const int WARM_UP = 20;

// An e-puck with its eight infrared sensors of three rays.
class Wanderer : public Enki::EPuck {
public:
	virtual void controlStep(double dt) {
		const double right = std::min(infraredSensor0.getDist(), infraredSensor1.getDist());
		const double left = std::min(infraredSensor7.getDist(), infraredSensor6.getDist());
		leftSpeed = rightSpeed = SPEED;
		if (std::min(left, right) < NEAR)
			(left < right ? rightSpeed : leftSpeed) = -SPEED;
		Enki::EPuck::controlStep(dt);
	}
};

int main(int, char **words) {
	const int robots = atoi(words[1]);
	const double seconds = atof(words[2]);
	const int columns = int(std::ceil(std::sqrt(robots)));
	Enki::World world(columns * SHARE, columns * SHARE);
	for (int number = 0; number < robots; number++) {
		Wanderer *robot = new Wanderer;
		robot->pos = Enki::Point((number % columns + 0.5) * SHARE, (number / columns + 0.5) * SHARE);
		robot->angle = number;
		world.addObject(robot);
	}
	for (int step = 0; step < WARM_UP; step++)
		world.step(0.05);
	long steps = 0;
	double spent = 0;
	for (const clock_t began = clock(); spent < seconds; spent = double(clock() - began) / CLOCKS_PER_SEC) {
		world.step(0.05);
		steps += robots;
	}
	printf("%ld %f\n", steps, spent);
}
