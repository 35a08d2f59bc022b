# An image with the program bslam on Debian 12:
#   docker build -t bslam .
#   docker run --rm -v "$PWD:/data" bslam run /data/MH_01_easy --out /data/out
# The first stage builds the Debian packages, the second installs that of the program.
FROM debian:12-slim AS build
COPY . /src
WORKDIR /src
RUN apt-get update -q && scripts/build_debs

FROM debian:12-slim
COPY --from=build /src/build/packages/bslam_*.deb /tmp/
RUN apt-get update -q && apt-get install -y -q --no-install-recommends /tmp/bslam_*.deb && \
    rm -rf /tmp/bslam_*.deb /var/lib/apt/lists/*
WORKDIR /data
ENTRYPOINT ["bslam"]
