-- description: Takes of messages that no callback was called with. Not those of the states of goals
--     that a client of an action takes for itself: no code of a node gets them.
-- grain: one row per such take
CREATE OR REPLACE MACRO derive.take_by_hand(only_run) AS TABLE
SELECT
    t.run_id, t.take_id, t.subscription_id, t.trace_id, t.process_id, t.thread_id, t.taken_ns,
    t.start_event_id, t.is_loss_affected
FROM store.take AS t
ANTI JOIN (SELECT take_id FROM store.callback_instance WHERE run_id = only_run) AS i
    ON t.take_id = i.take_id
ANTI JOIN derive.goal_state_subscription AS s ON t.subscription_id = s.subscription_id
WHERE t.run_id = only_run
