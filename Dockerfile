FROM python:3.12-slim
WORKDIR /opt/borechain
COPY requirements.lock pyproject.toml README.md LICENSE ./
RUN python -m pip install --no-cache-dir --require-hashes --requirement requirements.lock
COPY borechain borechain
COPY groundstation groundstation
COPY node node
COPY sim sim
COPY telemetry telemetry
COPY scenarios scenarios
RUN python -m pip install --no-cache-dir --no-build-isolation --no-deps . \
 && useradd --create-home operator && mkdir /state && chown operator /state
USER operator
ENTRYPOINT ["borechain"]
