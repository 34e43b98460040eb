-- name: main.host
-- description: Machines and containers.
-- grain: one row per machine or container
-- column: host_id BIGINT  Identity of the host
-- column: run_id BIGINT  Run that the row belongs to
-- column: clock_id BIGINT  Clock of the host
-- column: hostname VARCHAR  Name recorded in the trace, or given by the user
-- needs: store.host
SELECT
    self.host_id,
    self.run_id,
    self.clock_id,
    self.hostname
FROM store.host AS self
