-- name: main.link_response
-- description: Responses and the callback instance that sent them.
-- grain: one row per response and the callback instance that sent it
-- column: run_id BIGINT  Run that the row belongs to
-- column: response_id BIGINT  Effect
-- column: callback_instance_id BIGINT  Cause
-- needs: store.link_response
SELECT
    self.run_id,
    self.response_id,
    self.callback_instance_id
FROM store.link_response AS self
