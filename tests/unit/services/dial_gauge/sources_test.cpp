// A pty replaces the receiver: bytes that a test writes to its master arrive on the line.
#include <cmath>
#include <cstdlib>

#include <boost/asio/io_context.hpp>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <termios.h>
#include <unistd.h>

#include "base/posix/system.hpp"
#include "services/dial_gauge/receiver.hpp"
#include "services/dial_gauge/serial_line.hpp"
#include "services/dial_gauge/simulated_source.hpp"
#include "tests/support/hex_vectors.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/wait_for.hpp"

namespace millrace::services::dial_gauge {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

class Pty {
 public:
  Pty() : master_(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC)) {
    ::grantpt(master_.get());
    ::unlockpt(master_.get());
  }
  [[nodiscard]] std::string device() const { return ::ptsname(master_.get()); }
  void send(std::string_view bytes) const {
    ASSERT_EQ(::write(master_.get(), bytes.data(), bytes.size()),
              static_cast<ssize_t>(bytes.size()));
  }
  void send_vector(const std::string& name) const {
    const auto bytes = tests::hex_vector("dial_gauge/u_wave.hex", name);
    send({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  }
  /// The settings of the line, as the other end has made them.
  [[nodiscard]] termios settings() const {
    termios settings{};
    ::tcgetattr(master_.get(), &settings);
    return settings;
  }
  void unplug() { master_.close(); }

 private:
  base::posix::Fd master_;
};

/// What the service does with a line, and its log lines.
class Listener : public SerialLineListener {
 public:
  void on_opened() override {
    ++opened;
    receiver.opened();
  }
  void on_closed(const std::string& reason) override {
    closed.push_back(reason);
    receiver.closed(reason);
  }
  void on_bytes(std::string_view bytes) override {
    for (const std::string& text : receiver.hear(bytes, Time::clock::now())) {
      broken.push_back(text);
    }
  }

  Receiver receiver{Form::u_wave, Unit::mm};
  int opened = 0;
  std::vector<std::string> closed;
  std::vector<std::string> broken;
};

class SerialLineTest : public testing::Test {
 protected:
  SerialLineTest() { std::filesystem::create_symlink(pty->device(), device); }

  bool until(const std::function<bool()>& done) { return tests::run_until(context, done); }
  bool has_value(unsigned channel, Nanometres value) {
    return until([&] {
      const auto newest = listener.receiver.newest(channel);
      return newest && newest->value == value;
    });
  }

  std::optional<Pty> pty{std::in_place};
  tests::TemporaryFolder folder;
  std::string device = folder.path() / "receiver";
  boost::asio::io_context context;
  Listener listener;
  SerialLine sut{context.get_executor(), {.device = device, .reopen = 10ms}, listener};
};

TEST_F(SerialLineTest, CarriesValuesOfAReceiver) {
  ASSERT_TRUE(until([&] { return listener.opened == 1; }));
  pty->send_vector("good");
  EXPECT_TRUE(has_value(3, 12'700'000));
  EXPECT_EQ(listener.receiver.newest(0)->value, 11'880'000);
  EXPECT_EQ(listener.receiver.newest(2)->value, -1'000);
  EXPECT_THAT(listener.broken, SizeIs(0));
}

TEST_F(SerialLineTest, RunsAsTheReceiverDoes) {
  ASSERT_TRUE(until([&] { return listener.opened == 1; }));
  const termios settings = pty->settings();
  EXPECT_EQ(::cfgetospeed(&settings), speed_t{B57600});
  EXPECT_EQ(settings.c_cflag & CSIZE, tcflag_t{CS8});
  EXPECT_EQ(settings.c_cflag & (PARENB | CSTOPB), tcflag_t{0});
  // A CR must stay a CR, and no input may wait for a line's end.
  EXPECT_EQ(settings.c_iflag & ICRNL, tcflag_t{0});
  EXPECT_EQ(settings.c_lflag & (ICANON | ECHO), tcflag_t{0});
}

TEST_F(SerialLineTest, PassesBrokenFramesWithoutAValue) {
  ASSERT_TRUE(until([&] { return listener.opened == 1; }));
  pty->send_vector("tail_of_a_frame");
  ASSERT_TRUE(has_value(0, 1'500'000));
  for (const char* const vector : {"lost_digit", "bad_characters", "endless"}) {
    pty->send_vector(vector);
  }
  ASSERT_TRUE(has_value(0, 11'880'000));
  EXPECT_THAT(listener.broken, SizeIs(9));
}

TEST_F(SerialLineTest, IsOpenedAgainWhenTheReceiverReturns) {
  ASSERT_TRUE(until([&] { return listener.opened == 1; }));
  pty->unplug();
  ASSERT_TRUE(until([&] { return listener.closed.size() == 1; }));
  EXPECT_THAT(listener.closed[0], HasSubstr(device));
  EXPECT_EQ(listener.receiver.newest(0).error().fault, Fault::line_down);

  pty.emplace();
  std::filesystem::remove(device);
  std::filesystem::create_symlink(pty->device(), device);
  ASSERT_TRUE(until([&] { return listener.opened == 2; }));
  pty->send("DT10000+00000001.00M\r");
  EXPECT_TRUE(has_value(0, 1'000'000));
}

TEST(MissingSerialLine, IsReportedOnceWithItsReason) {
  boost::asio::io_context context;
  Listener listener;
  const SerialLine sut(context.get_executor(), {.device = "/no/such/line", .reopen = 1ms},
                       listener);
  ASSERT_TRUE(tests::run_until(context, [&] { return !listener.closed.empty(); }));
  int turns = 0;
  tests::run_until(context, [&] { return ++turns == 20; });
  EXPECT_THAT(listener.closed, ElementsAre(HasSubstr("/no/such/line: No such file")));
}

const Time start = Time{} + 100s;

TEST(SimulatedGauge, ShowsItsNominalValue) {
  SimulatedSource sut({.nominal_mm = {12.345}}, start);
  const auto reading = sut.read(start + 1s);
  ASSERT_TRUE(reading);
  EXPECT_EQ(reading->value, 12'345'000);
  EXPECT_EQ(reading->taken, start + 1s);
}

TEST(SimulatedGauge, MeasuresOnePartAfterTheOther) {
  SimulatedSource sut({.nominal_mm = {1, 2}}, start);
  EXPECT_EQ(sut.read(start)->value, 1'000'000);
  EXPECT_EQ(sut.read(start)->value, 2'000'000);
  EXPECT_EQ(sut.read(start)->value, 1'000'000);
}

TEST(SimulatedGauge, IsTheSameForTheSameSeed) {
  const Simulation simulation{.seed = 42, .nominal_mm = {5}, .noise_um = 10, .resolution_um = 0.1};
  SimulatedSource sut(simulation, start);
  SimulatedSource same(simulation, start);
  Simulation reseeded = simulation;
  reseeded.seed = 43;
  SimulatedSource other(reseeded, start);
  bool differs = false;
  for (int i = 0; i < 20; ++i) {
    const Nanometres value = sut.read(start)->value;
    EXPECT_EQ(same.read(start)->value, value);
    differs |= other.read(start)->value != value;
  }
  EXPECT_TRUE(differs);
}

/// The first value is a literal: it must be the same with every compiler and library.
TEST(SimulatedGauge, IsTheSameOnEveryPlatform) {
  SimulatedSource sut({.seed = 42, .nominal_mm = {5}, .noise_um = 10, .resolution_um = 0.1}, start);
  EXPECT_EQ(sut.read(start)->value, 5'000'200);
}

TEST(SimulatedGauge, ScattersAsConfigured) {
  SimulatedSource sut({.nominal_mm = {5}, .noise_um = 2, .resolution_um = 0.001}, start);
  double sum = 0;
  double squares = 0;
  constexpr int count = 10'000;
  for (int i = 0; i < count; ++i) {
    const double deviation_um = static_cast<double>(sut.read(start)->value - 5'000'000) / 1000;
    sum += deviation_um;
    squares += deviation_um * deviation_um;
  }
  EXPECT_NEAR(sum / count, 0, 0.1);
  EXPECT_NEAR(std::sqrt(squares / count), 2, 0.1);
}

TEST(SimulatedGauge, DriftsWithTime) {
  SimulatedSource sut({.nominal_mm = {5}, .drift_um_per_hour = -6}, start);
  EXPECT_EQ(sut.read(start + 30min)->value, 4'997'000);
}

TEST(SimulatedGauge, ShowsStepsOfItsResolution) {
  SimulatedSource sut({.nominal_mm = {1.2345}, .resolution_um = 10}, start);
  EXPECT_EQ(sut.read(start)->value, 1'230'000);
}

TEST(SimulatedGauge, LosesAsManyReadingsAsConfigured) {
  SimulatedSource sut({.nominal_mm = {5}, .radio_loss_percent = 25}, start);
  int lost = 0;
  for (int i = 0; i < 4000; ++i) {
    const auto reading = sut.read(start);
    lost += reading ? 0 : 1;
    EXPECT_TRUE(reading || reading.error().fault == Fault::no_contact);
  }
  EXPECT_NEAR(lost, 1000, 100);
  EXPECT_EQ(sut.condition().failures, static_cast<std::uint64_t>(lost));
}

TEST(SimulatedGauge, RunsItsBatteryLowAndThenEmpty) {
  SimulatedSource sut({.nominal_mm = {5},
                       .battery_percent = 30,
                       .battery_per_reading_percent = 10,
                       .battery_low_percent = 15},
                      start);
  EXPECT_TRUE(sut.read(start));
  EXPECT_TRUE(sut.read(start));
  EXPECT_EQ(sut.condition().battery_percent, 10U);
  EXPECT_EQ(sut.read(start).error().fault, Fault::battery_low);
  EXPECT_EQ(sut.read(start).error().fault, Fault::no_contact);
  EXPECT_EQ(sut.condition().battery_percent, 0U);
}

}  // namespace
}  // namespace millrace::services::dial_gauge
