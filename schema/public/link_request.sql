-- name: main.link_request
-- description: Requests and what sent them.
-- grain: one row per request that a callback instance or thread sent
-- column: run_id BIGINT  Run that the row belongs to
-- column: request_id BIGINT  Effect
-- column: callback_instance_id BIGINT  Cause
-- needs: store.link_request
SELECT
    self.run_id,
    self.request_id,
    self.callback_instance_id
FROM store.link_request AS self
