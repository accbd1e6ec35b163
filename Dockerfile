FROM python:3.12-slim
WORKDIR /source
COPY requirements.lock pyproject.toml README.md LICENSE ./
RUN python -m pip install --no-cache-dir --require-hashes --requirement requirements.lock
COPY borechain borechain
COPY groundstation groundstation
COPY node node
COPY sim sim
COPY telemetry telemetry
COPY scenarios scenarios
# the sources go once they are installed, so that nothing is imported or compiled from here instead
RUN python -m pip install --no-cache-dir --no-build-isolation --no-deps . \
 && rm -rf /source/* \
 && useradd --create-home operator && mkdir /state /keys && chown operator /state /keys
USER operator
WORKDIR /home/operator
# half a minute of compiling that no container then spends at its start
RUN python -c "import borechain.drilling.preload_all"
ENTRYPOINT ["borechain"]
