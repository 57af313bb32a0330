// Asio's TLS, compiled once, as the rest of Asio is (deploy/cmake/Dependencies.cmake).
#include <boost/asio/ssl/impl/src.hpp>
