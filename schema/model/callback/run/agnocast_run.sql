-- description: Which runs of callbacks are Agnocast's.
-- grain: one row per such run
-- when: raw.agnocast_agnocast_callable_start
SELECT event_id AS start_event_id FROM raw.agnocast_agnocast_callable_start
