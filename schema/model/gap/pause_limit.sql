-- description: What silences of a trace are taken to be like. All numbers that the rules of pauses
--     know are here, each with its reason.
CREATE OR REPLACE MACRO staging.pause_limit() AS {
    -- A stop and a start are further apart: a daemon passes each command on to every process.
    -- Nor is more time between the streams that one command ends.
    'least_ns': 1000000,
    -- Where a system is often as silent for a while, it is so again within a few times that.
    'usual_factor': 4,
    -- Most timers come round in a second: what is usual shows in it.
    'usual_ns': 1000000000,
    -- A timer that ends packets is late by less.
    'timer_ns': 5000000,
    -- So many others may have ended packets between two that are its own, or it none.
    'reach': 4
}
