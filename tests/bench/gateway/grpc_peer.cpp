// gRPC unary calls over TCP on loopback, for comparison.
#include "echo.grpc.pb.h"
#include <grpcpp/grpcpp.h>

#include "tests/bench/gateway/peers.hpp"

namespace millrace::bench {

namespace {

class EchoService final : public Echo::Service {
  grpc::Status Call(grpc::ServerContext*, const EchoRequest* request, EchoReply* reply) override {
    reply->set_data(request->data());
    return grpc::Status::OK;
  }
};

}  // namespace

void serve_grpc(const PeerOptions&) {
  EchoService service;
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(&service);
  const auto server = builder.BuildAndStart();
  peer_is_ready(std::to_string(port));
  wait_for_ever();
}

std::optional<Series> measure_grpc(std::size_t calls, std::size_t size) {
  PeerOptions options;
  options.kind = "grpc";
  tests::Process peer = start_peer(options);
  const std::string port = peer.await("^ready (\\d+)").at(1);
  const auto stub =
      Echo::NewStub(grpc::CreateChannel("127.0.0.1:" + port, grpc::InsecureChannelCredentials()));
  Series series;
  EchoRequest request;
  request.set_data(std::string(size, 'x'));
  for (std::size_t i = 0; i < calls + calls / 10; ++i) {
    grpc::ClientContext context;
    EchoReply reply;
    const auto start = Clock::now();
    if (!stub->Call(&context, request, &reply).ok()) {
      return std::nullopt;
    }
    if (i >= calls / 10) {
      series.add(Clock::now() - start);
    }
  }
  return series;
}

}  // namespace millrace::bench
