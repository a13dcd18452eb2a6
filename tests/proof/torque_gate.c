/* Any settings in their ranges, then any torque asked for at any samples: what leaves is finite and within the limit. */
#include "any.h"

#include "app/torque_gate.h"

void main(void)
{
    lever_settings_t settings;
    (void)memset(&settings, 0, sizeof settings);
    settings.sample_period = Frama_C_float_interval(1.0e-4f, 2.0e-2f);
    settings.dither_fade = Frama_C_float_interval(0.0f, 60.0f);
    settings.torque_limit = Frama_C_float_interval(0.0f, 10.0f);
    settings.torque_slew = Frama_C_float_interval(1.0f, 1.0e5f);
    settings.torque_rms = Frama_C_float_interval(0.0f, 10.0f);
    torque_gate_t gate;
    torque_gate_init(&gate, &settings);
    while (any_bool()) {
        const torque_sample_t sample = {any_word(), any_bool(), any_bool(), any_bool(), any_bool()};
        torque_gate_step(&gate, any_float(), &sample);
        torque_gate_idle(&gate, any_word());
        if (any_bool()) {
            torque_gate_keep_alive(&gate);
        }
        if (any_bool()) {
            torque_gate_close(&gate);
        }
        (void)torque_gate_is_abandoned(&gate);
    }
}
