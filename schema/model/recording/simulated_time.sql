-- description: What time it was in the simulation, as CARET's clock recorder said.
-- grain: one row per ros2_caret:sim_time
-- when: raw.ros2_caret_sim_time
SELECT
    process_id,
    ts_ns AS at_ns,
    stamp AS simulated_ns
FROM staging.located('raw.ros2_caret_sim_time')
ORDER BY event_id
