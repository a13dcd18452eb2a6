/* Each message is decoded from any frame, and encoded from any values of its members, floats all finite or all infinite.
 * Eva 25 does not decide comparisons with NaN: that is for tests/python/can, under the sanitizers for tests/unit. */
#include "any.h"

#include "can/messages.h"

#include <math.h>

#define PROVE(name, members)                                                                                           \
    static void prove_##name(float f)                                                                                  \
    {                                                                                                                  \
        message_##name##_t message;                                                                                    \
        lever_frame_t frame = any_frame();                                                                             \
        (void)Frama_C_make_unknown((char *)&message, sizeof message);                                                  \
        members;                                                                                                       \
        (void)message_##name##_encode(&frame, &message);                                                               \
        frame = any_frame();                                                                                           \
        (void)message_##name##_decode(&message, &frame);                                                               \
    }
#define SET(member) message.member = f
#define FLAG(member) message.member = any_bool()
#define THREE(member) SET(member[0]), SET(member[1]), SET(member[2])

PROVE(
    lever_sample, (SET(theta), SET(theta_dot), SET(tau_m), FLAG(theta_valid), FLAG(theta_dot_valid), FLAG(tau_m_valid)))
PROVE(base_sample, (SET(z_ddot), FLAG(z_ddot_valid)))
PROVE(grip_sample, (SET(grip_force), FLAG(grip_force_valid)))
PROVE(command, SET(dither_rms))
PROVE(state_estimate, (SET(theta), SET(theta_dot), SET(innovation), FLAG(valid)))
PROVE(pilot_parameters, (THREE(parameter), FLAG(valid)))
PROVE(pilot_sigma, (THREE(sigma), FLAG(valid)))
PROVE(pilot_dynamics,
    (SET(natural_frequency), SET(natural_frequency_sigma), SET(damping_ratio), SET(damping_ratio_sigma), FLAG(valid)))
PROVE(feedthrough, (SET(real), SET(imaginary), SET(gain_sigma), SET(phase_sigma), FLAG(valid)))
PROVE(stability,
    (SET(gain_margin), SET(gain_margin_sigma), SET(modulus), SET(modulus_sigma), SET(frequency), FLAG(valid)))
PROVE(health, SET(excitation))
PROVE(motor_command, (SET(torque), SET(dither), FLAG(valid)))
PROVE(correction, (SET(correction), SET(weight), FLAG(valid)))
PROVE(platform_health, FLAG(valid))
PROVE(platform_reset, (void)f)
PROVE(identity, SET(dither_rms))
PROVE(command_ack, SET(dither_rms))
PROVE(link_health, FLAG(valid))

static void prove_all(float f)
{
    prove_lever_sample(f);
    prove_base_sample(f);
    prove_grip_sample(f);
    prove_command(f);
    prove_state_estimate(f);
    prove_pilot_parameters(f);
    prove_pilot_sigma(f);
    prove_pilot_dynamics(f);
    prove_feedthrough(f);
    prove_stability(f);
    prove_health(f);
    prove_motor_command(f);
    prove_correction(f);
    prove_platform_health(f);
    prove_platform_reset(f);
    prove_identity(f);
    prove_command_ack(f);
    prove_link_health(f);
}

void main(void)
{
    prove_all(any_finite());
    prove_all(INFINITY);
    prove_all(-INFINITY);
}
