-- name: main.callback_group_member
-- description: Callbacks of the callback groups.
-- grain: one row per callback in a callback group
-- column: run_id BIGINT  Run that the row belongs to
-- column: callback_group_id BIGINT  The callback group
-- column: callback_id BIGINT  The callback
-- needs: store.callback_group_member
SELECT
    self.run_id,
    self.callback_group_id,
    self.callback_id
FROM store.callback_group_member AS self
