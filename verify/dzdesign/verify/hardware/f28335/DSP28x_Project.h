/* In the place of the F2833x device headers: what the firmware touches, written from the register layout (SPRUI07).
 * Bit-fields start at bit 0, as on the C28x. What EALLOW protects, and bits that act when written, are of device.c. */
#ifndef DSP28X_PROJECT_H
#define DSP28X_PROJECT_H

#include <stdint.h>

#define __interrupt

#ifndef DSP28_DATA_TYPES
#define DSP28_DATA_TYPES
typedef uint16_t Uint16;
#endif

#define EPWM_MODULES 6u

#define REGISTER(name, ...)                                                                                          \
    union                                                                                                            \
    {                                                                                                                \
        uint16_t all;                                                                                                \
        struct                                                                                                       \
        {                                                                                                            \
            __VA_ARGS__                                                                                              \
        } bit;                                                                                                       \
    } name

#define TB_COUNT_UP 0u
#define TB_COUNT_DOWN 1u
#define TB_COUNT_UPDOWN 2u
#define TB_FREEZE 3u
#define TB_DIV1 0u
#define TB_DIV2 1u
#define TB_ENABLE 1u
#define TB_DISABLE 0u
#define TB_CTR_ZERO 1u
#define CC_SHADOW 0u
#define CC_IMMEDIATE 1u
#define CC_CTR_ZERO 0u
#define AQ_NO_ACTION 0u
#define AQ_CLEAR 1u
#define AQ_SET 2u
#define AQ_TOGGLE 3u
#define TZ_ENABLE 1u
#define TZ_HIZ 0u
#define TZ_FORCE_HI 1u
#define TZ_FORCE_LO 2u
#define TZ_NO_CHANGE 3u
#define ET_CTR_ZERO 1u
#define ET_CTR_PRD 2u
#define ET_CTRU_CMPA 4u
#define ET_CTRU_CMPB 6u
#define ET_1ST 1u
#define ET_2ND 2u
#define ET_3RD 3u
#define M_INT3 0x0004u
#define PIEACK_GROUP3 0x0004u

struct EPWM_REGS
{
    REGISTER(TBCTL, uint16_t CTRMODE : 2; uint16_t PHSEN : 1; uint16_t PRDLD : 1; uint16_t SYNCOSEL : 2;
             uint16_t SWFSYNC : 1; uint16_t HSPCLKDIV : 3; uint16_t CLKDIV : 3; uint16_t PHSDIR : 1;
             uint16_t FREE_SOFT : 2;);
    union
    {
        uint32_t all;
        struct
        {
            uint16_t TBPHSHR;
            uint16_t TBPHS;
        } half;
    } TBPHS;
    uint16_t TBCTR, TBPRD;
    REGISTER(CMPCTL, uint16_t LOADAMODE : 2; uint16_t LOADBMODE : 2; uint16_t SHDWAMODE : 1; uint16_t rsvd1 : 1;
             uint16_t SHDWBMODE : 1;);
    union
    {
        uint32_t all;
        struct
        {
            uint16_t CMPAHR;
            uint16_t CMPA;
        } half;
    } CMPA;
    uint16_t CMPB;
    REGISTER(AQCTLA, uint16_t ZRO : 2; uint16_t PRD : 2; uint16_t CAU : 2; uint16_t CAD : 2; uint16_t CBU : 2;
             uint16_t CBD : 2;);
    REGISTER(AQCTLB, uint16_t ZRO : 2;);
    REGISTER(AQSFRC, uint16_t ACTSFA : 2; uint16_t OTSFA : 1; uint16_t ACTSFB : 2; uint16_t OTSFB : 1;
             uint16_t RLDCSF : 2;);
    REGISTER(AQCSFRC, uint16_t CSFA : 2; uint16_t CSFB : 2;);
    REGISTER(DBCTL, uint16_t OUT_MODE : 2; uint16_t POLSEL : 2; uint16_t IN_MODE : 2;);
    REGISTER(PCCTL, uint16_t CHPEN : 1;);
    REGISTER(HRCNFG, uint16_t EDGMODE : 2; uint16_t CTLMODE : 1; uint16_t HRLOAD : 1;);
    REGISTER(TZSEL, uint16_t CBC : 6; uint16_t rsvd1 : 2; uint16_t OSHT1 : 1; uint16_t OSHT2 : 1; uint16_t OSHT3 : 1;
             uint16_t OSHT4 : 1; uint16_t OSHT5 : 1; uint16_t OSHT6 : 1;);
    REGISTER(TZCTL, uint16_t TZA : 2; uint16_t TZB : 2;);
    REGISTER(TZEINT, uint16_t rsvd1 : 1; uint16_t CBC : 1; uint16_t OST : 1;);
    REGISTER(TZFLG, uint16_t INT : 1; uint16_t CBC : 1; uint16_t OST : 1;);
    REGISTER(TZCLR, uint16_t INT : 1; uint16_t CBC : 1; uint16_t OST : 1;);
    REGISTER(TZFRC, uint16_t rsvd1 : 1; uint16_t CBC : 1; uint16_t OST : 1;);
    REGISTER(ETSEL, uint16_t INTSEL : 3; uint16_t INTEN : 1; uint16_t rsvd1 : 4; uint16_t SOCASEL : 3;
             uint16_t SOCAEN : 1; uint16_t SOCBSEL : 3; uint16_t SOCBEN : 1;);
    REGISTER(ETPS, uint16_t INTPRD : 2; uint16_t INTCNT : 2; uint16_t rsvd1 : 4; uint16_t SOCAPRD : 2;
             uint16_t SOCACNT : 2; uint16_t SOCBPRD : 2; uint16_t SOCBCNT : 2;);
    REGISTER(ETCLR, uint16_t INT : 1; uint16_t rsvd1 : 1; uint16_t SOCA : 1; uint16_t SOCB : 1;);
};

/* Results of sixteen conversions; those of AdcRegs are left-justified. */
struct ADC_RESULTS
{
    uint16_t ADCRESULT0, ADCRESULT1, ADCRESULT2, ADCRESULT3, ADCRESULT4, ADCRESULT5, ADCRESULT6, ADCRESULT7;
    uint16_t ADCRESULT8, ADCRESULT9, ADCRESULT10, ADCRESULT11, ADCRESULT12, ADCRESULT13, ADCRESULT14, ADCRESULT15;
};

struct ADC_REGS
{
    uint16_t ADCRESULT0, ADCRESULT1, ADCRESULT2, ADCRESULT3, ADCRESULT4, ADCRESULT5, ADCRESULT6, ADCRESULT7;
    uint16_t ADCRESULT8, ADCRESULT9, ADCRESULT10, ADCRESULT11, ADCRESULT12, ADCRESULT13, ADCRESULT14, ADCRESULT15;
    REGISTER(ADCTRL1, uint16_t rsvd1 : 4; uint16_t SEQ_CASC : 1; uint16_t SEQ_OVRD : 1; uint16_t CONT_RUN : 1;
             uint16_t CPS : 1; uint16_t ACQ_PS : 4; uint16_t SUSMOD : 2; uint16_t RESET : 1;);
    REGISTER(ADCTRL2, uint16_t EPWM_SOCB_SEQ2 : 1; uint16_t rsvd1 : 1; uint16_t INT_MOD_SEQ2 : 1;
             uint16_t INT_ENA_SEQ2 : 1; uint16_t rsvd2 : 1; uint16_t SOC_SEQ2 : 1; uint16_t RST_SEQ2 : 1;
             uint16_t EXT_SOC_SEQ1 : 1; uint16_t EPWM_SOCA_SEQ1 : 1; uint16_t rsvd3 : 1; uint16_t INT_MOD_SEQ1 : 1;
             uint16_t INT_ENA_SEQ1 : 1; uint16_t rsvd4 : 1; uint16_t SOC_SEQ1 : 1; uint16_t RST_SEQ1 : 1;
             uint16_t EPWM_SOCB_SEQ : 1;);
    REGISTER(ADCTRL3, uint16_t SMODE_SEL : 1; uint16_t ADCCLKPS : 4; uint16_t ADCPWDN : 1; uint16_t ADCBGRFDN : 2;);
    REGISTER(ADCMAXCONV, uint16_t MAX_CONV1 : 4; uint16_t MAX_CONV2 : 3;);
    REGISTER(ADCCHSELSEQ1, uint16_t CONV00 : 4; uint16_t CONV01 : 4; uint16_t CONV02 : 4; uint16_t CONV03 : 4;);
    REGISTER(ADCCHSELSEQ2, uint16_t CONV04 : 4; uint16_t CONV05 : 4; uint16_t CONV06 : 4; uint16_t CONV07 : 4;);
    REGISTER(ADCCHSELSEQ3, uint16_t CONV08 : 4; uint16_t CONV09 : 4; uint16_t CONV10 : 4; uint16_t CONV11 : 4;);
    REGISTER(ADCCHSELSEQ4, uint16_t CONV12 : 4; uint16_t CONV13 : 4; uint16_t CONV14 : 4; uint16_t CONV15 : 4;);
    REGISTER(ADCST, uint16_t INT_SEQ1 : 1; uint16_t INT_SEQ2 : 1; uint16_t SEQ1_BSY : 1; uint16_t SEQ2_BSY : 1;
             uint16_t INT_SEQ1_CLR : 1; uint16_t INT_SEQ2_CLR : 1;);
};

struct SCI_REGS
{
    REGISTER(SCICCR, uint16_t SCICHAR : 3; uint16_t ADDRIDLE_MODE : 1; uint16_t LOOPBKENA : 1; uint16_t PARITYENA : 1;
             uint16_t PARITY : 1; uint16_t STOPBITS : 1;);
    REGISTER(SCICTL1, uint16_t RXENA : 1; uint16_t TXENA : 1; uint16_t SLEEP : 1; uint16_t TXWAKE : 1;
             uint16_t rsvd1 : 1; uint16_t SWRESET : 1; uint16_t RXERRINTENA : 1;);
    uint16_t SCIHBAUD, SCILBAUD;
    REGISTER(SCICTL2, uint16_t TXINTENA : 1; uint16_t RXBKINTENA : 1; uint16_t rsvd1 : 4; uint16_t TXEMPTY : 1;
             uint16_t TXRDY : 1;);
    REGISTER(SCIRXST, uint16_t rsvd : 1; uint16_t RXWAKE : 1; uint16_t PE : 1; uint16_t OE : 1; uint16_t FE : 1;
             uint16_t BRKDT : 1; uint16_t RXRDY : 1; uint16_t RXERROR : 1;);
    REGISTER(OCTETS_IN[1], uint16_t RXDT : 8; uint16_t rsvd : 6; uint16_t SCIFFPE : 1; uint16_t SCIFFFE : 1;);
    uint16_t SCITXBUF;
    REGISTER(SCIFFTX, uint16_t TXFFIL : 5; uint16_t TXFFIENA : 1; uint16_t TXFFINTCLR : 1; uint16_t TXFFINT : 1;
             uint16_t TXFFST : 5; uint16_t TXFIFOXRESET : 1; uint16_t SCIFFENA : 1; uint16_t SCIRST : 1;);
    REGISTER(SCIFFRX, uint16_t RXFFIL : 5; uint16_t RXFFIENA : 1; uint16_t RXFFINTCLR : 1; uint16_t RXFFINT : 1;
             uint16_t RXFFST : 5; uint16_t RXFIFORESET : 1; uint16_t RXFFOVRCLR : 1; uint16_t RXFFOVF : 1;);
    REGISTER(SCIFFCT, uint16_t FFTXDLY : 8; uint16_t rsvd1 : 5; uint16_t CDC : 1; uint16_t ABDCLR : 1; uint16_t ABD : 1;);
};

extern volatile struct SCI_REGS device_plain_sci; /* for a program without the model */

struct SYS_CTRL_REGS
{
    REGISTER(PLLSTS, uint16_t PLLLOCKS : 1; uint16_t rsvd1 : 1; uint16_t PLLOFF : 1; uint16_t MCLKSTS : 1;
             uint16_t MCLKCLR : 1; uint16_t OSCOFF : 1; uint16_t MCLKOFF : 1; uint16_t DIVSEL : 2;);
    REGISTER(HISPCP, uint16_t HSPCLK : 3;);
    REGISTER(LOSPCP, uint16_t LSPCLK : 3;);
    REGISTER(PCLKCR0, uint16_t rsvd1 : 2; uint16_t TBCLKSYNC : 1; uint16_t ADCENCLK : 1; uint16_t rsvd2 : 1;
             uint16_t SCICENCLK : 1; uint16_t rsvd3 : 4; uint16_t SCIAENCLK : 1; uint16_t SCIBENCLK : 1;);
    REGISTER(PLLCR, uint16_t DIV : 4;);
    uint16_t SCSR, WDCR;
};

/* Eight pins of so many bits each. */
#define PINS_0(n) uint16_t GPIO0 : n, GPIO1 : n, GPIO2 : n, GPIO3 : n, GPIO4 : n, GPIO5 : n, GPIO6 : n, GPIO7 : n;
#define PINS_1(n) uint16_t GPIO8 : n, GPIO9 : n, GPIO10 : n, GPIO11 : n, GPIO12 : n, GPIO13 : n, GPIO14 : n, GPIO15 : n;
#define PINS_2(n) uint16_t GPIO16 : n, GPIO17 : n, GPIO18 : n, GPIO19 : n, GPIO20 : n, GPIO21 : n, GPIO22 : n, GPIO23 : n;
#define PINS_3(n) uint16_t GPIO24 : n, GPIO25 : n, GPIO26 : n, GPIO27 : n, GPIO28 : n, GPIO29 : n, GPIO30 : n, GPIO31 : n;
#define PINS_4(n) uint16_t GPIO32 : n, GPIO33 : n, GPIO34 : n, GPIO35 : n, GPIO36 : n, GPIO37 : n, GPIO38 : n, GPIO39 : n;
#define PINS_5(n) uint16_t GPIO40 : n, GPIO41 : n, GPIO42 : n, GPIO43 : n, GPIO44 : n, GPIO45 : n, GPIO46 : n, GPIO47 : n;
#define PINS_6(n) uint16_t GPIO48 : n, GPIO49 : n, GPIO50 : n, GPIO51 : n, GPIO52 : n, GPIO53 : n, GPIO54 : n, GPIO55 : n;
#define PINS_7(n) uint16_t GPIO56 : n, GPIO57 : n, GPIO58 : n, GPIO59 : n, GPIO60 : n, GPIO61 : n, GPIO62 : n, GPIO63 : n;
#define OF_PINS(name, ...)                                                                                           \
    union                                                                                                            \
    {                                                                                                                \
        uint32_t all;                                                                                                \
        struct                                                                                                       \
        {                                                                                                            \
            __VA_ARGS__                                                                                              \
        } bit;                                                                                                       \
    } name
#define PORT_A PINS_0(1) PINS_1(1) PINS_2(1) PINS_3(1)
#define PORT_B PINS_4(1) PINS_5(1) PINS_6(1) PINS_7(1)

struct GPIO_CTRL_REGS
{
    OF_PINS(GPAQSEL1, PINS_0(2) PINS_1(2));
    OF_PINS(GPAQSEL2, PINS_2(2) PINS_3(2));
    OF_PINS(GPBQSEL1, PINS_4(2) PINS_5(2));
    OF_PINS(GPBQSEL2, PINS_6(2) PINS_7(2));
    OF_PINS(GPAMUX1, PINS_0(2) PINS_1(2));
    OF_PINS(GPAMUX2, PINS_2(2) PINS_3(2));
    OF_PINS(GPBMUX1, PINS_4(2) PINS_5(2));
    OF_PINS(GPBMUX2, PINS_6(2) PINS_7(2));
    OF_PINS(GPADIR, PORT_A);
    OF_PINS(GPBDIR, PORT_B);
    OF_PINS(GPAPUD, PORT_A);
    OF_PINS(GPBPUD, PORT_B);
};

struct GPIO_DATA_REGS
{
    OF_PINS(GPADAT, PORT_A);
    OF_PINS(GPASET, PORT_A);
    OF_PINS(GPACLEAR, PORT_A);
    OF_PINS(GPATOGGLE, PORT_A);
    OF_PINS(GPBDAT, PORT_B);
    OF_PINS(GPBSET, PORT_B);
    OF_PINS(GPBCLEAR, PORT_B);
    OF_PINS(GPBTOGGLE, PORT_B);
};

struct PIE_CTRL_REGS
{
    REGISTER(PIEACK, uint16_t ACK1 : 1; uint16_t ACK2 : 1; uint16_t ACK3 : 1;);
    REGISTER(PIEIER3, uint16_t INTx1 : 1; uint16_t INTx2 : 1; uint16_t INTx3 : 1; uint16_t INTx4 : 1;
             uint16_t INTx5 : 1; uint16_t INTx6 : 1;);
};

struct PIE_VECT_TABLE
{
    void (*EPWM1_INT)(void), (*EPWM2_INT)(void), (*EPWM3_INT)(void);
    void (*EPWM4_INT)(void), (*EPWM5_INT)(void), (*EPWM6_INT)(void);
};

extern volatile struct EPWM_REGS EPwmRegs[EPWM_MODULES];
#define EPwm1Regs EPwmRegs[0]
#define EPwm2Regs EPwmRegs[1]
#define EPwm3Regs EPwmRegs[2]
#define EPwm4Regs EPwmRegs[3]
#define EPwm5Regs EPwmRegs[4]
#define EPwm6Regs EPwmRegs[5]
extern volatile struct ADC_REGS AdcRegs;
extern volatile struct ADC_RESULTS AdcMirror;
extern volatile struct SYS_CTRL_REGS SysCtrlRegs;
extern volatile struct GPIO_CTRL_REGS GpioCtrlRegs;
extern volatile struct GPIO_DATA_REGS GpioDataRegs;
extern volatile struct PIE_CTRL_REGS PieCtrlRegs;
extern volatile struct PIE_VECT_TABLE PieVectTable;
extern volatile unsigned int IER, IFR;
/* Every access goes through the model: a write to SCITXBUF moves an octet, TXFFST counts those that wait. */
#ifndef SciaRegs
#define SciaRegs (*device_sci(0u))
#endif
#define ScibRegs (*device_sci(1u))
#define ScicRegs (*device_sci(2u))
volatile struct SCI_REGS *device_sci(unsigned line);
/* A read takes an octet out of the FIFO. */
#define SCIRXBUF OCTETS_IN[device_octet_in()]
unsigned device_octet_in(void);
extern Uint16 RamfuncsLoadStart, RamfuncsLoadEnd, RamfuncsRunStart;

#define EALLOW device_eallow()
#define EDIS device_edis()
#define EINT device_eint()
#define DINT device_dint()

void device_eallow(void);
void device_edis(void);
void device_eint(void);
void device_dint(void);

void DisableDog(void);
void InitPll(Uint16 factor, Uint16 divider);
void InitPeripheralClocks(void);
void InitFlash(void);
void InitPieCtrl(void);
void InitPieVectTable(void);
void InitAdc(void);
void ServiceDog(void);
void MemCopy(Uint16 *source, Uint16 *source_end, Uint16 *destination);

#endif
