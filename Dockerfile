# Image of the command `alliance`, for docs/examples/kubernetes-job.yaml and for use without Rust:
#   docker build -t alliance-sim . && docker run --rm --init -v "$PWD/runs:/home/alliance/runs" alliance-sim run --in-process
# The page listens on the container's loopback only. To open it, use the host's network (--network host).
FROM rust:1.95-slim-bookworm AS build
WORKDIR /src
COPY . .
RUN cargo build --release --locked --package launch --bin alliance --features mcap,ros,foxglove \
    && strip target/release/alliance

FROM debian:bookworm-slim
RUN useradd --create-home --uid 10001 alliance && mkdir /home/alliance/runs && chown alliance /home/alliance/runs
COPY --from=build /src/target/release/alliance /usr/local/bin/alliance
USER 10001
WORKDIR /home/alliance
ENTRYPOINT ["alliance"]
CMD ["run"]
