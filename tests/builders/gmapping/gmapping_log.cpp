// Run GMapping on a CARMEN log of lines ROBOTLASER1, and write its map as a PGM: 0 occupied, 127 unknown, 255 free.
//
//     gmapping_log LOG MAP.pgm LEFT LOW RIGHT HIGH CELL
//
// LEFT to HIGH bound the map in metres, CELL is the side of a cell. The filter starts at the first pose of the log. What
// is not said here has the defaults of the ROS node slam_gmapping. Prints the seconds of processor time, and the number
// of scans that entered the map.
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iostream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include <gmapping/gridfastslam/gridslamprocessor.h>
#include <gmapping/sensor/sensor_range/rangesensor.h>

using namespace GMapping;

namespace {

const unsigned PARTICLES = 30;
const double OCCUPIED = 0.25;  // the share of beams that ended in a cell, from which on the node calls it occupied
const double NEVER = -1.0;     // seconds after which a scan enters the map though the robot stands

struct Log {
  double first_angle, between, range;
  std::vector<std::vector<double>> ranges;
  std::vector<OrientedPoint> poses;
};

Log read_log(const char* path) {
  Log log;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string name;
    double kind, fov, accuracy, mode, x, y, heading;
    size_t beams, remissions;
    words >> name;
    if (name != "ROBOTLASER1") continue;
    words >> kind >> log.first_angle >> fov >> log.between >> log.range >> accuracy >> mode >> beams;
    std::vector<double> ranges(beams);
    for (double& each : ranges) words >> each;
    words >> remissions >> x >> y >> heading;
    if (!words || remissions) {
      std::cerr << "a line that is no reading: " << line.substr(0, 60) << "\n";
      std::exit(1);
    }
    log.ranges.push_back(ranges);
    log.poses.emplace_back(x, y, heading);
  }
  return log;
}

}  // namespace

int main(int count, char** words) {
  if (count != 8) {
    std::cerr << "usage: gmapping_log LOG MAP.pgm LEFT LOW RIGHT HIGH CELL\n";
    return 1;
  }
  const Log log = read_log(words[1]);
  if (log.ranges.empty()) {
    std::cerr << words[1] << ": no line ROBOTLASER1\n";
    return 1;
  }
  const double left = std::atof(words[3]), low = std::atof(words[4]), right = std::atof(words[5]),
               high = std::atof(words[6]), cell = std::atof(words[7]);
  const unsigned beams = static_cast<unsigned>(log.ranges[0].size());
  RangeSensor laser("FLASER", beams, log.between, OrientedPoint(0, 0, 0), 0, log.range);
  std::vector<double> angles;
  for (unsigned i = 0; i < beams; ++i) {
    angles.push_back(log.first_angle + i * log.between);
    laser.beams()[i].pose.theta = angles.back();
  }
  laser.updateBeamsLookup();

  std::ostream nowhere(nullptr);
  std::cerr.rdbuf(nullptr);  // it tells of each scan
  auto filter = std::make_unique<GridSlamProcessor>(nowhere);
  SensorMap sensors;
  sensors.insert(std::make_pair(laser.getName(), &laser));
  filter->setSensorMap(sensors);
  filter->setMatchingParameters(log.range, log.range + 0.01, 0.05, 1, 0.05, 0.05, 5, 0.075, 3.0, 0);
  filter->setMotionModelParameters(0.02, 0.02, 0.0, 0.02);
  filter->setUpdateDistances(0.3, 0.17, 0.5);
  filter->setUpdatePeriod(NEVER);
  filter->setgenerateMap(false);
  filter->init(PARTICLES, left, low, right, high, cell, log.poses[0]);
  filter->setllsamplerange(0.01);
  filter->setllsamplestep(0.01);
  filter->setlasamplerange(0.005);
  filter->setlasamplestep(0.005);
  sampleGaussian(1, 1);  // seeds it

  const std::clock_t begun = std::clock();
  unsigned entered = 0;
  for (size_t i = 0; i < log.ranges.size(); ++i) {
    RangeReading reading(beams, log.ranges[i].data(), &laser, 0.2 * static_cast<double>(i));
    reading.setPose(log.poses[i]);
    entered += filter->processScan(reading);
  }
  const double seconds = static_cast<double>(std::clock() - begun) / CLOCKS_PER_SEC;

  // as the node does, the map is drawn anew along the path of the likeliest particle
  ScanMatcher matcher;
  matcher.setLaserParameters(beams, angles.data(), OrientedPoint(0, 0, 0));
  matcher.setlaserMaxRange(log.range + 0.01);
  matcher.setusableRange(log.range);
  matcher.setgenerateMap(true);
  ScanMatcherMap map(Point(left + right, low + high) * 0.5, right - left, high - low, cell);
  for (auto* node = filter->getParticles()[filter->getBestParticleIndex()].node; node; node = node->parent) {
    if (!node->reading) continue;
    matcher.invalidateActiveArea();
    matcher.computeActiveArea(map, node->pose, &(*node->reading)[0]);
    matcher.registerScan(map, node->pose, &(*node->reading)[0]);
  }

  const ScanMatcherMap& drawn = map;  // of a map that may change, cells that no scan met cannot be asked for
  const int cols = static_cast<int>(std::lround((right - left) / cell));
  const int rows = static_cast<int>(std::lround((high - low) / cell));
  std::ofstream picture(words[2], std::ios::binary);
  picture << "P5\n" << cols << " " << rows << "\n255\n";
  for (int row = 0; row < rows; ++row)
    for (int col = 0; col < cols; ++col) {
      const Point middle(left + (col + 0.5) * cell, high - (row + 0.5) * cell);
      const double share = drawn.cell(drawn.world2map(middle));
      picture.put(static_cast<char>(share < 0 ? 127 : share > OCCUPIED ? 0 : 255));
    }
  std::cout << seconds << " " << entered << "\n";
  return picture.good() ? 0 : 1;
}
