// SPDX-License-Identifier: BSD-3-Clause
// A phone in software: MJPEG over HTTP on loopback, with faults.
#include "drivers/network/network_source.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <thread>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wold-style-cast"
#pragma GCC diagnostic ignored "-Wshadow"
#include <httplib.h>
#pragma GCC diagnostic pop

#include "core/image/image_codec.hpp"
#include "tests/support/slow_peers.hpp"

namespace orbitfuse::network {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using ::testing::Not;
using Clock = std::chrono::steady_clock;

std::string jpeg_of(int number, cv::Size size = {64, 48}) {
  cv::Mat image(size, CV_8UC3, cv::Scalar(30, 60, 90));
  image.colRange(0, 1 + number % size.width) = cv::Scalar(200, 10, 10);
  return *encode_jpeg(image, 90);
}

/// What it sends next over the connection; false ends the connection.
using Send = std::function<bool(int number, const std::function<bool(const std::string&)>& write)>;

class Phone {
 public:
  Phone() {
    server.Get("/video", [this](const httplib::Request&, httplib::Response& response) {
      ++connections;
      if (refuse) {
        response.status = 503;
        return;
      }
      response.set_chunked_content_provider("multipart/x-mixed-replace; boundary=frame",
                                            [this](std::size_t, httplib::DataSink& sink) {
                                              const auto write = [&](const std::string& bytes) {
                                                return sink.write(bytes.data(), bytes.size());
                                              };
                                              for (int k = 0; !over && !hang_up; ++k) {
                                                if (!part(number++, write)) break;
                                                std::this_thread::sleep_for(20ms);
                                              }
                                              hang_up = false;
                                              sink.done();
                                              return false;
                                            });
    });
    server.set_keep_alive_max_count(1);
    port = server.bind_to_any_port("127.0.0.1");
    listener = std::thread([this] { server.listen_after_bind(); });
    while (!server.is_running()) std::this_thread::sleep_for(1ms);
  }
  ~Phone() {
    over = true;
    server.stop();
    listener.join();
  }
  static std::string head(std::size_t size) {
    return "--frame\r\nContent-Type: image/jpeg\r\nContent-Length: " + std::to_string(size) +
           "\r\n\r\n";
  }
  static bool whole(int number, const std::function<bool(const std::string&)>& write) {
    const std::string jpeg = jpeg_of(number);
    return write(head(jpeg.size()) + jpeg + "\r\n");
  }
  std::string url() const { return "http://127.0.0.1:" + std::to_string(port) + "/video"; }

  std::atomic<bool> over{false}, hang_up{false}, refuse{false};
  std::atomic<int> number{0}, connections{0};
  Send part = whole;  ///< set before a source starts
  int port = 0;

 private:
  httplib::Server server;
  std::thread listener;
};

struct Came {
  std::vector<Frame> frames;
  std::vector<std::string> events;
  std::uint64_t rejected = 0, next_id = 0, gaps = 0;
  bool rising = true;
  std::int64_t last_ns = 0;
  bool has(const std::string& event) const {
    return std::find(events.begin(), events.end(), event) != events.end();
  }
  void note(const Delivery& d) {
    if (d.kind == Delivery::Kind::event) events.push_back(d.reason);
    if (d.kind == Delivery::Kind::rejected) ++rejected;
    if (d.kind != Delivery::Kind::frame && d.kind != Delivery::Kind::rejected) return;
    rising = rising && d.frame.id >= next_id;
    gaps += d.frame.id - next_id;
    next_id = d.frame.id + 1;
    if (d.kind != Delivery::Kind::frame) return;
    rising = rising && d.frame.host_time_ns > last_ns;
    last_ns = d.frame.host_time_ns.value_or(0);
    frames.push_back(d.frame);
  }
};

class NetworkTest : public ::testing::Test {
 protected:
  NetworkOptions options(const std::string& url) const {
    NetworkOptions o;
    o.feed.url = url;
    o.feed.open = 4000ms;
    o.feed.stall = 700ms;
    o.feed.reopen_every = 50ms;
    return o;
  }
  static Came drain(NetworkSource& source, const std::function<bool(const Came&)>& enough,
                    std::chrono::seconds limit = 30s, std::uint64_t next_id = 0) {
    Came came;
    came.next_id = next_id;
    const auto end = Clock::now() + limit;
    while (Clock::now() < end && !enough(came)) {
      const Result<Delivery> delivery = source.next(100ms);
      EXPECT_TRUE(delivery);
      if (!delivery) break;
      came.note(*delivery);
    }
    return came;
  }
  static auto frames(std::size_t n) {
    return [n](const Came& c) { return c.frames.size() >= n; };
  }
};

TEST_F(NetworkTest, JpegsAreKeptAsTheyWereSent) {
  Phone phone;
  NetworkSource source(options(phone.url()));
  const Status status = source.start();
  ASSERT_TRUE(status) << status.error().message();
  const Came came = drain(source, frames(20));
  ASSERT_GE(came.frames.size(), 20u);
  EXPECT_TRUE(came.rising);
  EXPECT_EQ(came.gaps + came.rejected, 0u);
  std::vector<std::string> sent;
  for (int i = 0; i < 64; ++i) sent.push_back(jpeg_of(i));
  int expected = -1;
  for (const Frame& frame : came.frames) {
    EXPECT_EQ(frame.extension, ".jpg");
    const auto found = std::find(sent.begin(), sent.end(), frame.encoded);
    ASSERT_NE(found, sent.end()) << "not a JPEG that was sent, byte for byte: "
                                 << frame.encoded.size() << " bytes, " << sent[0].size();
    const auto number = static_cast<int>(found - sent.begin());
    if (expected >= 0) {
      EXPECT_EQ(number, expected);
    }
    expected = (number + 1) % 64;
  }
  EXPECT_EQ(source.describe().driver, "network");
}

TEST_F(NetworkTest, AnEndedConnectionIsToldReopenedAndCostsItsTime) {
  Phone phone;
  NetworkSource source(options(phone.url()));
  ASSERT_TRUE(source.start());
  const std::uint64_t next = drain(source, frames(15)).next_id;
  phone.hang_up = true;
  const Came came = drain(
      source, [](const Came& c) { return c.has("reconnected") && c.frames.size() > 5; }, 30s, next);
  EXPECT_TRUE(came.has("disconnected"));
  EXPECT_TRUE(came.has("reconnected"));
  EXPECT_EQ(came.events.front(), "disconnected");
  EXPECT_TRUE(came.rising);
  EXPECT_GE(came.gaps, 1u) << "50 ms and more at some 50 Hz";
  EXPECT_EQ(phone.connections, 2);
}

TEST_F(NetworkTest, AStallIsToldAndItsFramesAreCountedByTime) {
  Phone phone;
  std::atomic<bool> stalls{false}, was{false};
  phone.part = [&](int number, const auto& write) {
    if (stalls && !was) {
      was = true;
      for (int i = 0; i < 150 && !phone.over; ++i) std::this_thread::sleep_for(10ms);
    }
    return Phone::whole(number, write);
  };
  NetworkSource source(options(phone.url()));
  ASSERT_TRUE(source.start());
  Came before = drain(source, frames(15));
  const std::uint64_t next = before.next_id;
  stalls = true;
  Came came;
  came.next_id = next;
  const auto end = Clock::now() + 30s;
  while (Clock::now() < end && !(came.has("reconnected") && came.frames.size() > 20)) {
    const Result<Delivery> delivery = source.next(100ms);
    ASSERT_TRUE(delivery);
    came.note(*delivery);
  }
  EXPECT_TRUE(came.has("stalled"));
  ASSERT_TRUE(came.has("reconnected"));
  EXPECT_GE(came.gaps, 3u) << "0.7 s and more at some 50 Hz";
  EXPECT_TRUE(came.rising);
}

TEST_F(NetworkTest, AFrameThatIsCutOffIsNoFrame) {
  Phone phone;
  phone.part = [&](int number, const auto& write) {
    if (number != 12) return Phone::whole(number, write);
    const std::string jpeg = jpeg_of(number);
    write(Phone::head(jpeg.size()) + jpeg.substr(0, jpeg.size() / 2));
    return false;
  };
  NetworkSource source(options(phone.url()));
  ASSERT_TRUE(source.start());
  const Came came = drain(source, frames(20));
  EXPECT_TRUE(came.has("disconnected"));
  EXPECT_TRUE(came.has("reconnected"));
  EXPECT_TRUE(came.rising);
  for (const Frame& frame : came.frames) EXPECT_TRUE(decode_jpeg(frame.encoded, "f"));
}

TEST_F(NetworkTest, AGarbageBoundaryIsABrokenStreamAndRecovered) {
  Phone phone;
  phone.part = [&](int number, const auto& write) {
    if (number != 12) return Phone::whole(number, write);
    return write(std::string("\0\xff--fr\r\n\r\nContent-Length: 99999999999\r\n\r\n", 40)) &&
           write(std::string(3000, '\xee'));
  };
  NetworkSource source(options(phone.url()));
  ASSERT_TRUE(source.start());
  const Came came = drain(source, frames(30));
  EXPECT_GE(came.frames.size(), 30u);
  EXPECT_TRUE(came.rising);
  EXPECT_TRUE(came.rejected > 0 || came.has("reconnected")) << "without a word";
  for (const Frame& frame : came.frames) EXPECT_TRUE(decode_jpeg(frame.encoded, "f"));
}

TEST_F(NetworkTest, OneThatIsAwayAtTheEndIsCountedAndNobodyWaits) {
  auto phone = std::make_unique<Phone>();
  NetworkSource source(options(phone->url()));
  ASSERT_TRUE(source.start());
  drain(source, frames(15));
  phone.reset();
  const Came came = drain(source, [](const Came& c) { return c.has("reopen-failed"); });
  EXPECT_TRUE(came.has("disconnected") || came.has("stalled"));
  EXPECT_TRUE(came.has("reopen-failed"));
  const std::vector<Delivery> rest = source.unfinished();
  ASSERT_FALSE(rest.empty());
  EXPECT_EQ(rest.back().kind, Delivery::Kind::lost);
  EXPECT_GE(rest.back().frame.id, came.next_id + 3) << "four attempts at some 50 Hz";
  source.stop();
}

TEST_F(NetworkTest, FramesThatNobodyTookAreLostByCount) {
  Phone phone;
  NetworkOptions o = options(phone.url());
  o.feed.stall = 20s;  // nothing is counted by time
  NetworkSource source(o);
  ASSERT_TRUE(source.start());
  while (phone.number < 70) std::this_thread::sleep_for(5ms);
  Came came;
  const std::vector<Delivery> rest = source.unfinished();
  const int sent = phone.number;
  for (const Delivery& d : rest) came.note(d);
  ASSERT_FALSE(rest.empty());
  EXPECT_EQ(came.frames.size(), 32u);
  EXPECT_EQ(came.gaps, 0u);
  ASSERT_EQ(rest.back().kind, Delivery::Kind::lost);
  EXPECT_NEAR(static_cast<double>(rest.back().frame.id) + 1, sent, 15);
  EXPECT_FALSE(source.next(0ms)->kind == Delivery::Kind::frame);
}

TEST_F(NetworkTest, NothingComesAfterTheEnd) {
  Phone phone;
  phone.part = [](int number, const auto& write) {  // as fast as the line
    for (int i = 0; i < 50; ++i)
      if (!Phone::whole(number, write)) return false;
    return true;
  };
  VideoFeed feed(options(phone.url()).feed);
  ASSERT_TRUE(feed.take(5s));
  ASSERT_TRUE(feed.take(5s));
  feed.close();
  for (int i = 0; i < 33 && feed.take(0ms); ++i) {
  }
  std::this_thread::sleep_for(200ms);  // the reader may be within a frame
  EXPECT_FALSE(feed.take(0ms));
}

TEST_F(NetworkTest, WhatNobodyTookBeforeAnOutageIsCountedOnce) {
  Phone phone;
  NetworkSource source(options(phone.url()));
  ASSERT_TRUE(source.start());
  while (phone.number < 150) std::this_thread::sleep_for(5ms);  // over 100 of them not taken
  std::this_thread::sleep_for(500ms);  // what is on the line when it is hung up is not read
  phone.hang_up = true;
  while (phone.connections < 2) std::this_thread::sleep_for(5ms);
  Came came = drain(source, [](const Came& c) { return c.has("reconnected") && c.gaps > 0; });
  EXPECT_GE(came.next_id, 140u);
  EXPECT_LE(came.next_id, static_cast<std::uint64_t>(phone.number) + 60) << "about 100 twice";
}

TEST_F(NetworkTest, WaitingFramesAreBoundedInBytes) {
  Phone phone;
  NetworkOptions o = options(phone.url());
  o.feed.max_queued_bytes = 4 * jpeg_of(63).size();
  o.feed.stall = 20s;
  NetworkSource source(o);
  ASSERT_TRUE(source.start());
  while (phone.number < 40) std::this_thread::sleep_for(5ms);
  Came came;
  for (const Delivery& d : source.unfinished()) came.note(d);
  EXPECT_GE(came.frames.size(), 2u);
  EXPECT_LE(came.frames.size(), 5u);

  o.feed.max_queued_bytes = 100;
  NetworkSource small(o);
  ASSERT_TRUE(small.start());
  const Result<Delivery> refused = small.next(10s);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->reason, "disconnected");
  EXPECT_THAT(refused->detail, HasSubstr("bytes came"));
}

TEST_F(NetworkTest, PicturesOfAnotherSizeAreRefusedByWordsUntilTheSizeIsBack) {
  Phone phone;
  std::atomic<bool> small{false};
  phone.part = [&](int number, const auto& write) {
    const std::string jpeg = jpeg_of(number, small ? cv::Size(32, 24) : cv::Size(64, 48));
    return write(Phone::head(jpeg.size()) + jpeg + "\r\n");
  };
  NetworkSource source(options(phone.url()));
  ASSERT_TRUE(source.start());
  std::uint64_t next = drain(source, frames(15)).next_id;
  small = true;
  const Came odd = drain(
      source, [](const Came& c) { return c.has("reopen-failed"); }, 30s, next);
  EXPECT_EQ(odd.rejected, 1u);
  EXPECT_TRUE(odd.has("disconnected"));
  EXPECT_TRUE(odd.has("reopen-failed")) << "told once it lasts";
  EXPECT_GE(phone.connections, 4);
  small = false;
  const Came back = drain(source, frames(5), 30s, odd.next_id);
  EXPECT_TRUE(back.has("reconnected"));
  EXPECT_GE(back.gaps, 1u);
  for (const Came* came : {&odd, &back}) {
    for (const Frame& frame : came->frames)
      EXPECT_EQ(decode_jpeg(frame.encoded, "f")->size(), cv::Size(64, 48));
  }
}

TEST_F(NetworkTest, WhatIsNoStreamIsRefusedInTimeAndSecretsStayUntold) {
  Phone phone;
  phone.refuse = true;
  NetworkOptions o =
      options("http://me:secret@127.0.0.1:" + std::to_string(phone.port) + "/video?key=hidden");
  NetworkSource refused(o);
  const Status status = refused.start();
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().kind, ErrorKind::device);
  EXPECT_THAT(status.error().message(), HasSubstr("127.0.0.1"));
  EXPECT_THAT(status.error().message(), Not(HasSubstr("secret")));
  EXPECT_THAT(refused.describe().serial, Not(HasSubstr("hidden")));

  NetworkSource nobody(options("http://127.0.0.1:1/video"));
  EXPECT_FALSE(nobody.start());
}

/// Accepts connections and says nothing.
TEST_F(NetworkTest, OneThatNeverAnswersIsGivenUpAtTheDeadline) {
  const test::SilentListener listener;
  ASSERT_NE(listener.port(), 0);
  NetworkOptions o = options("http://127.0.0.1:" + std::to_string(listener.port()) + "/video");
  o.feed.open = 600ms;
  NetworkSource source(o);
  const Status status = source.start();  // hangs for ever without a deadline
  EXPECT_FALSE(status);
}

TEST(NetworkOptionsTest, OnlyAddressesOfStreams) {
  for (const char* url : {"", "http://", "file:///etc/passwd", "/dev/video0", "concat:a|b",
                          "http://a b/", "ftp://a/b", "rtsp:/a"}) {
    NetworkOptions o;
    o.feed.url = url;
    EXPECT_FALSE(o.validate()) << url;
  }
  for (const char* url : {"http://192.168.1.7:8080/video", "rtsp://cam/stream?a=b,c"}) {
    NetworkOptions o;
    o.feed.url = url;
    EXPECT_TRUE(o.validate()) << url;
  }
  EXPECT_EQ(public_url("rtsp://u:p@h:554/s?x=1#y"), "rtsp://h:554/s");
  EXPECT_EQ(public_url("http://h"), "http://h");
  EXPECT_EQ(public_url("http://h/a@b"), "http://h/a@b");
  EXPECT_EQ(public_url("nonsense"), "");
}

}  // namespace
}  // namespace orbitfuse::network
