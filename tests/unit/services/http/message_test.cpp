#include "services/http/message.hpp"

#include <boost/json/parse.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/http/url.hpp"

namespace millrace::services::http {
namespace {

using namespace std::chrono_literals;
using sdk::Response;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

Endpoint endpoint() {
  return {.announcement = {.name = "press"}, .url = "http://127.0.0.1:8000/measure"};
}

fabric::Request request(std::string text) {
  return {.key = {.machine = "cnc", .channel = 2},
          .call = {.epoch = 0x5f3a, .number = 17},
          .attempt = 3,
          .uuid = "1b671a64",
          .text = std::move(text),
          .state = 4};
}

Exchange response(int status, std::string type, std::string body) {
  return {.status = status, .content_type = std::move(type), .body = std::move(body)};
}

Response answer(const Exchange& exchange) {
  return std::get<Answer>(judge(endpoint(), exchange)).response;
}

Response answer(int status, std::string type, std::string body) {
  return answer(response(status, std::move(type), std::move(body)));
}

TEST(HttpPost, HasTheCallAsJson) {
  const Post sut = post_for(endpoint(), request("Ma\xDF \x80\n\"1\""), 1500ms, {});
  const auto body = boost::json::parse(sut.body).as_object();
  EXPECT_EQ(body.at("uuid"), "1b671a64");
  EXPECT_EQ(body.at("text"), "Maß €\n\"1\"");
  EXPECT_EQ(body.at("state"), 4);
  EXPECT_EQ(body.at("machine"), "cnc");
  EXPECT_EQ(body.at("channel"), 2);
  EXPECT_EQ(body.at("call"), "5f3a-17");
  EXPECT_EQ(body.at("attempt"), 3);
  EXPECT_EQ(body.at("deadline_ms"), 1500);
  EXPECT_EQ(body.at("replayed"), false);
}

TEST(HttpPost, HasTheSameKeyForEachAttempt) {
  EXPECT_THAT(post_for(endpoint(), request("x"), 1s, {}).headers,
              Contains("Idempotency-Key: 5f3a-17"));
}

TEST(HttpPost, HasATokenOnlyIfThereIsOne) {
  Endpoint with = endpoint();
  with.bearer_token.contents = "secret";
  EXPECT_THAT(post_for(with, request("x"), 1s, {}).headers,
              Contains("Authorization: Bearer secret"));
  EXPECT_THAT(post_for(endpoint(), request("x"), 1s, {}).headers,
              Not(Contains(StartsWith("Authorization"))));
}

/// The expected value is of: printf '%s' "5f3a-17.1614265330.$BODY" | openssl dgst -sha256 -mac
/// HMAC -macopt hexkey:… -binary | base64
TEST(HttpPost, IsSignedAsAWebhook) {
  Endpoint with = endpoint();
  with.signing_secret.contents = std::string(32, 'k');
  const Post sut = post_for(with, request("x"), 1s, fabric::Time(1614265330s));
  ASSERT_EQ(sut.body, R"({"uuid":"1b671a64","text":"x","state":4,"machine":"cnc","channel":2,)"
                      R"("call":"5f3a-17","attempt":3,"deadline_ms":1000,"replayed":false})");
  EXPECT_THAT(sut.headers, Contains("webhook-id: 5f3a-17"));
  EXPECT_THAT(sut.headers, Contains("webhook-timestamp: 1614265330"));
  EXPECT_THAT(sut.headers,
              Contains("webhook-signature: v1,//93bwHbM8Nrb/kf7XelqKOLgA6H5iDoZqEj62piJ38="));
}

TEST(HttpResponse, OfJsonHasTextAndState) {
  EXPECT_EQ(answer(200, "application/json; charset=utf-8", R"({"text": "Maß", "state": 7})"),
            (Response{.text = "Ma\xDF", .state = 7}));
  EXPECT_EQ(answer(200, "application/json", R"({"text": "4", "other": []})"), (Response{"4", 1}));
  EXPECT_EQ(answer(201, "application/vnd.x+json", R"({"state": 4294967295})"),
            (Response{"", 4294967295U}));
}

TEST(HttpResponse, OfTextHasItsStateInAHeader) {
  EXPECT_EQ(answer(200, "text/plain", "4\r\n"), (Response{"4", 1}));
  Exchange exchange = response(200, "text/plain", "4");
  exchange.state = "9";
  EXPECT_EQ(answer(exchange), (Response{"4", 9}));
  exchange.state = "nine";
  EXPECT_EQ(answer(exchange).state, 13U);
}

TEST(HttpResponse, OfAPlainStringIsATextInEveryFramework) {
  EXPECT_EQ(answer(200, "text/html; charset=utf-8", "4"), (Response{"4", 1})) << "Flask, Express";
  EXPECT_EQ(answer(204, "", ""), (Response{"", 1}));
  const Response page = answer(200, "text/html", "<!doctype html>");
  EXPECT_EQ(page.state, 13U);
  EXPECT_EQ(page.text,
            "ERROR: response of press: text/html; expected application/json or text/plain");
}

TEST(HttpResponse, ThatCannotBeWrittenIsAnErrorWithItsReason) {
  const auto reason = [](std::string type, std::string body) {
    const Response sut = answer(200, std::move(type), std::move(body));
    EXPECT_EQ(sut.state, 13U) << sut.text;
    EXPECT_THAT(sut.text, StartsWith("ERROR: response of press: "));
    return sut.text;
  };
  EXPECT_THAT(reason("application/json", R"({"text": )"), HasSubstr("not JSON: "));
  EXPECT_THAT(reason("application/json", ""), HasSubstr("not JSON: "));
  EXPECT_THAT(reason("application/json", "{\"text\": \"Ma\xDF\"}"), HasSubstr("not JSON: "));
  EXPECT_THAT(reason("application/json", std::string(50'000, '[')), HasSubstr("not JSON: "));
  EXPECT_THAT(reason("application/json", "4"), HasSubstr("no JSON object"));
  EXPECT_THAT(reason("application/json", "{}"), HasSubstr("neither text nor state"));
  EXPECT_THAT(reason("application/json", R"({"text": 4})"), HasSubstr("its text is not a string"));
  EXPECT_THAT(reason("application/json", R"({"state": "1"})"), HasSubstr("not a whole number"));
  EXPECT_THAT(reason("application/json", R"({"state": -1})"), HasSubstr("not a whole number"));
  EXPECT_THAT(reason("application/json", R"({"state": 1.0})"), HasSubstr("not a whole number"));
  EXPECT_THAT(reason("application/json", R"({"state": 4294967296})"),
              HasSubstr("state 4294967296"));
  EXPECT_THAT(reason("application/json", R"({"state": 1e400})"), HasSubstr("not a whole number"));
  EXPECT_THAT(reason("application/json", R"({"state": 18446744073709551616})"),
              HasSubstr("not a whole number"));
  EXPECT_THAT(reason("application/json", R"({"state": 0})"), HasSubstr("state 0"));
  EXPECT_THAT(reason("application/json", R"({"text": "a\u0000b"})"), HasSubstr("NUL"));
  EXPECT_THAT(reason("text/plain", "\xE4\xB8\xAD"), HasSubstr("U+4E2D at byte 1"));
  EXPECT_THAT(reason("text/plain", "Ma\xDF"), HasSubstr("not UTF-8"));
  EXPECT_THAT(reason("text/plain", std::string(128, 'x')), HasSubstr("128 bytes, at most 127 fit"));
  EXPECT_EQ(answer(200, "text/plain", std::string(127, 'x')).text.size(), 127U) << "never cut";
  EXPECT_THAT(reason("image/png", "x"), HasSubstr("image/png"));
  EXPECT_EQ(answer({.end = Exchange::End::too_long}).text,
            "ERROR: response of press: more than 65536 bytes");
  EXPECT_EQ(answer({.end = Exchange::End::not_http, .reason = "odd"}).text,
            "ERROR: response of press: not HTTP: odd");
}

TEST(HttpResponse, MayBeginWithAByteOrderMark) {
  EXPECT_EQ(answer(200, "application/json", "\xEF\xBB\xBF{\"text\": \"4\"}"), (Response{"4", 1}));
  EXPECT_EQ(answer(200, "text/plain",
                   "\xEF\xBB\xBF"
                   "4"),
            (Response{"4", 1}));
}

TEST(HttpResponse, WithANameTwiceHasTheLastOne) {
  EXPECT_EQ(
      answer(200, "application/json", R"({"text": "a", "state": 1, "text": "b", "state": 2})"),
      (Response{"b", 2}));
}

TEST(HttpResponse, OfAProxyWithAPasswordHasNotReachedTheEndpoint) {
  Endpoint behind = endpoint();
  behind.proxy = "http://proxy:3128";
  EXPECT_THAT(std::get<NotBegun>(judge(behind, response(407, "text/html", "no"))).reason,
              HasSubstr("the proxy asks for a password"));
  EXPECT_EQ(answer(407, "text/html", "no").state, 407U) << "without a proxy";
}

TEST(HttpResponse, OfAnErrorHasItsStatusAsState) {
  EXPECT_EQ(answer(503, "text/html", "<h1>no</h1>"), (Response{"ERROR: HTTP 503", 503}));
  EXPECT_EQ(answer(404, "text/plain", "no such part\nat all"),
            (Response{"ERROR: HTTP 404: no such part", 404}));
  EXPECT_EQ(answer(422, "application/problem+json", R"({"title": "No", "detail": "no depth"})"),
            (Response{"ERROR: HTTP 422: no depth", 422}));
  EXPECT_EQ(answer(400, "text/plain", std::string(300, 'x')).text.size(), 127U);
  EXPECT_EQ(answer(308, "", "").text,
            "ERROR: HTTP 308: is not followed; configure the URL it leads to");
}

TEST(HttpResponse, WithRetryAfterIsNoRoom) {
  for (const int status : {429, 503}) {
    Exchange exchange = response(status, "text/plain", "later");
    exchange.retry_after = 5s;
    EXPECT_EQ(std::get<NoRoom>(judge(endpoint(), exchange)).pause, 5s);
    exchange.retry_after = 100000s;
    EXPECT_EQ(std::get<NoRoom>(judge(endpoint(), exchange)).pause, 3600s);
    exchange.retry_after = 0s;
    EXPECT_EQ(std::get<NoRoom>(judge(endpoint(), exchange)).pause, 1s);
  }
  EXPECT_EQ(answer(429, "text/plain", "no").state, 429U) << "without it";
}

TEST(HttpResponse, ThatAcceptsNamesWhereTheResultWillBe) {
  Exchange exchange = response(202, "application/json", R"({"text": "half", "state": 5})");
  exchange.location = "/jobs/7";
  auto sut = std::get<Accepted>(judge(endpoint(), exchange));
  EXPECT_EQ(sut.url, "http://127.0.0.1:8000/jobs/7");
  EXPECT_EQ(sut.pause, 500ms);
  EXPECT_EQ(sut.interim, (Response{"half", 5}));

  exchange.body = R"({"id": 7})";
  exchange.retry_after = 2s;
  sut = std::get<Accepted>(judge(endpoint(), exchange));
  EXPECT_EQ(sut.interim, std::nullopt);
  EXPECT_EQ(sut.pause, 2s);

  exchange.location = "http://elsewhere.example.com/jobs/7";
  EXPECT_THAT(answer(exchange).text, HasSubstr("leads to another host"));
  exchange.location = "http://127.0.0.1:8001/jobs/7";
  EXPECT_THAT(answer(exchange).text, HasSubstr("leads to another host"));

  exchange.location.clear();
  exchange.body = R"({"text": "taken"})";
  EXPECT_EQ(answer(exchange), (Response{"taken", 1})) << "as any 2xx";
}

TEST(HttpExchange, WithoutAResponseSaysWhetherTheCallMayHaveRun) {
  EXPECT_EQ(
      std::get<NotBegun>(judge(endpoint(), {.end = Exchange::End::not_sent, .reason = "refused"}))
          .reason,
      "refused");
  EXPECT_EQ(
      std::get<Lost>(judge(endpoint(), {.end = Exchange::End::lost, .reason = "reset"})).reason,
      "reset");
  EXPECT_EQ(answer({.end = Exchange::End::time_limit}),
            (Response{"ERROR: press took longer than 30000 ms", 11}));
}

TEST(HttpUrl, IsHttpWithoutSecrets) {
  EXPECT_EQ(parse_url("https://[::1]/x").value().origin(), "https://[::1]:443");
  EXPECT_TRUE(parse_url("http://localhost:8000").value().is_loopback());
  EXPECT_FALSE(parse_url("http://10.0.0.5:8000").value().is_loopback());
  EXPECT_THAT(parse_url("ftp://host/x").error(), HasSubstr("expected http://"));
  EXPECT_THAT(parse_url("host/x").error(), HasSubstr("is not a URL"));
  EXPECT_THAT(parse_url("http://anna:pw@host/").error(), HasSubstr("bearer_token_file"));
  EXPECT_THAT(parse_url("http://host/#top").error(), HasSubstr("fragment"));
}

}  // namespace
}  // namespace millrace::services::http
